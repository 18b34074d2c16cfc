#!/usr/bin/env python3
"""What Feedwright makes of programs that others judge: one place, one command.

    tests/bench/scoreboards.py [rs274] [corpus] [linuxcnc] [--update]

Boards lie in tests/scoreboards. Each is made anew by its command and held against the one in git; a line that got worse is printed, and
the exit code is 1. `--update` writes the new boards. What cannot run here (rs274, LinuxCNC, ../shared) is said and skipped.

    rs274     motions as LinuxCNC's interpreter reads them: the test compares the board itself, line by line
    corpus    real programs: time before and after, largest load over its limit; worse is a longer time (0.2 %) or a load above 1.01
    linuxcnc  realised time against LinuxCNC's planner: worse is an error beyond 1.5 % that is also larger than the board's by 0.1 points
              (LinuxCNC's own runs differ by that much)"""
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BOARDS = os.path.join(ROOT, "tests", "scoreboards")
LONGER = 1.002  # share of the time that the F words of two builds may differ by
MET = 1.01  # largest load over its limit
OFF_PERCENT, JITTER_PERCENT = 1.5, 0.1


def output(*command):
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout


def old(name):
    path = os.path.join(BOARDS, f"{name}.txt")
    return open(path, encoding="utf-8").read().splitlines() if os.path.exists(path) else []


def keyed(lines, key):
    return {match.group(1): line for line in lines if (match := re.match(key, line))}


def numbers(line):
    return [float(word) for word in re.findall(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?![\w])", line)]


def rs274():
    code, text = output("cargo", "test", "--release", "--test", "nc_rs274", "--", "--nocapture")
    if "0 passed" in text:
        return None, ["SKIPPED: rs274 or ../shared is not there"]
    if code == 0:
        return None, []
    return None, [line for line in text.splitlines() if "scoreboard" in line or "panicked" in line]


def corpus():
    code, text = output("cargo", "test", "--release", "--test", "corpus_optimize", "--", "--nocapture", "--test-threads", "1")
    found = re.findall(r"^(?:test \S+ \.\.\. )?(\w+: [\d.]+ s → .*)$", text, re.M)
    if not found:
        return None, ["SKIPPED: ../shared is not there"] if code == 0 else text.splitlines()[-20:]
    worse = [] if code == 0 else ["a program does not pass: cargo test --release --test corpus_optimize"]
    before = keyed(old("corpus"), r"(\w+):")
    for name, line in keyed(found, r"(\w+):").items():
        _, after_s, load, *_ = numbers(line.split(":", 1)[1])
        limit = LONGER * numbers(before[name].split(":", 1)[1])[1] if name in before else float("inf")
        if after_s > limit or load > MET:
            worse.append(f"{before.get(name, 'new')}\n    → {line}")
    return found, worse


def linuxcnc():
    _, text = output("cargo", "bench", "--bench", "linuxcnc_time")
    found = [line for line in text.splitlines() if line.startswith("| ") and not line.startswith("| program")]
    if not found:
        absent = ["SKIPPED: LinuxCNC, its user or its scripts are not there"]
        return None, absent if "skipped" in text else text.splitlines()[-20:]
    worse = []
    key = r"\| (\w\S* \| [^|]+) \|"
    before = keyed(old("linuxcnc"), key)
    for name, line in keyed(found, key).items():
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) < 9:
            worse.append(f"not run: {line}")
            continue
        known = [cell.strip() for cell in before[name].split("|")] if name in before else None
        for column in (4, 7):
            allowed = max(OFF_PERCENT, abs(float(known[column])) + JITTER_PERCENT if known and len(known) > 8 else 0.0)
            if abs(float(cells[column])) > allowed:
                worse.append(f"{name}: {cells[column]} %, at most {allowed:.2f} %")
    return found, worse


def main():
    update = "--update" in sys.argv
    wanted = [word for word in sys.argv[1:] if not word.startswith("-")] or ["rs274", "corpus", "linuxcnc"]
    bad = False
    for name in wanted:
        found, said = {"rs274": rs274, "corpus": corpus, "linuxcnc": linuxcnc}[name]()
        skipped = any(line.startswith("SKIPPED") for line in said)
        bad |= bool(said) and not skipped
        print(f"{name}: {len(found or [])} lines, " + ("skipped" if skipped else f"{len(said)} worse" if said else "none worse"))
        print("".join(f"    {line}\n" for line in said), end="")
        if found and update:
            with open(os.path.join(BOARDS, f"{name}.txt"), "w", encoding="utf-8") as board:
                board.write("\n".join(found) + "\n")
    return bad


if __name__ == "__main__":
    sys.exit(main())
