#!/usr/bin/env python3
"""Feedwright beside the programs that do a part of the same work, in one run: every figure is a ratio of two measurements made
one after the other, the median of several turns. A peer that is not installed is said and skipped.

    pip install toppra opencamlib           # where they are wanted; FreeCAD: apt-get install freecad-python3
    tests/bench/peers.py [--turns 3] [--only toppra,copp,topp3,opencamlib,gcode,freecad] [--decades 3]

Prints machine, date and commit, and a table for MEASURED.md: what, size, seconds of both, ratio (theirs over ours, so above 1
is faster here), largest memory of both processes, and whether the answers agree. The peers from crates.io (copp, gcode) are
built from tests/bench/peers."""
import argparse
import datetime
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))


def said(*command):
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    return done.stdout.strip() if done.returncode == 0 else ""


def measured(command):
    """Its output and the largest memory it had, MB; output None where it fails."""
    read, write = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.dup2(write, 1)
        os.chdir(ROOT)
        os.execvp(command[0], command)
    os.close(write)
    with os.fdopen(read) as pipe:
        text = pipe.read()
    _, status, usage = os.wait4(pid, 0)
    return (text if status == 0 else None), usage.ru_maxrss / 1024


def benches():
    """Paths of the built benches, by name."""
    words = ["cargo", "bench", "--no-run", "--message-format=json"]
    words += ["--bench", "schedule", "--bench", "nc", "--bench", "stepover"]
    built = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
    found = {}
    for line in built.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable"):
            found[message["target"]["name"]] = message["executable"]
    if len(found) < 3:
        sys.exit(built.stderr)
    return found


def crates():
    """The peers from crates.io, or None and why not."""
    manifest = os.path.join(HERE, "peers", "Cargo.toml")
    target = os.path.join(ROOT, "target", "peers")
    words = ["cargo", "build", "--release", "--quiet", "--manifest-path", manifest, "--target-dir", target]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        return None, done.stderr.strip()[-200:]
    return os.path.join(target, "release", "feedwright-peers"), ""


def result(text):
    """Seconds and agreement of a peer's line."""
    line = next(line for line in (text or "").splitlines() if line.startswith("RESULT "))
    _, seconds, agreement = line.split(" ", 2)
    return float(seconds), agreement


def value(path, name):
    words = open(path, encoding="utf-8").readline().split()
    return float(words[words.index(name) + 1])


class Table:
    """Rows of a markdown table, printed as they come."""

    def __init__(self, turns):
        self.turns = turns
        print("| what | size | here, s | there, s | there / here | memory here / there, MB | agreement |")
        print("|---|---|---|---|---|---|---|")

    def row(self, what, size, turn):
        """`turn()`: seconds here and there, memory here and there, agreement; None where the peer gives no answer."""
        turns = [turn() for _ in range(self.turns)]
        if None in turns:
            print(f"| {what} | {size} | – | no answer | | | |", flush=True)
            return
        here, there, mine, theirs = (statistics.median(t[k] for t in turns) for k in range(4))
        ratio = statistics.median(t[1] / t[0] for t in turns)
        cells = [what, size, f"{here:.3g}", f"{there:.3g}", f"{ratio:.3g}", f"{mine:.0f} / {theirs:.0f}", turns[-1][4]]
        print(f"| {' | '.join(cells)} |", flush=True)


def schedule(table, what, kind, sizes, bench, peer, folder):
    for size in sizes:
        file = os.path.join(folder, f"{kind}.csv")

        def turn(size=size, file=file):
            _, mine = measured([bench, file, str(size)] + (["jerk"] if kind == "jerk" else []))
            text, theirs = measured(peer + [file])
            if text is None:
                return None
            seconds, agreement = result(text)
            return value(file, "seconds"), seconds, mine, theirs, agreement

        table.row(what, f"{size:,} points", turn)


def parsing(table, sizes, bench, crate, folder):
    for size in sizes:
        file = os.path.join(folder, "p.nc")

        def turn(size=size, file=file):
            text, mine = measured([bench, file, str(size)])
            answer, theirs = measured([crate, "gcode", file])
            if answer is None:
                return None
            seconds, agreement = result(answer)
            return float(text.split()[1]), seconds, mine, theirs, agreement

        table.row("every token of a program, crate gcode", f"{size:,} blocks", turn)


def dropping(table, widths, bench, folder):
    for wide in widths:

        def turn(wide=wide):
            _, mine = measured([bench, folder, str(wide)])
            answer, theirs = measured([sys.executable, os.path.join(HERE, "compare_opencamlib.py"), folder, "ball"])
            if answer is None:
                return None
            seconds, agreement = result(answer)
            with open(os.path.join(folder, "ball.csv"), encoding="utf-8") as file:
                ours, count = file.read().splitlines()[1].split()[4:6]
            return float(ours) / float(count) * 5000, seconds, mine, theirs, agreement

        size = f"{2 * wide * (wide * 13 // 20):,} triangles"
        table.row("5,000 places dropped on a mesh, ball; opencamlib", size, turn)


def absent(module):
    return subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True).returncode != 0


def machine():
    names = [line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
    cpu = names[0] if names else platform.machine()
    dirty = "" if not said("git", "status", "--porcelain", "--untracked-files=no") else " with changes"
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") >> 30
    print(f"{cpu}, {os.cpu_count()} cores, {memory} GiB, {platform.system()}; "
          f"{datetime.date.today()}; commit {said('git', 'rev-parse', '--short', 'HEAD')}{dirty}; {said('rustc', '--version')}; "
          f"load {os.getloadavg()[0]:.1f}\n")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--turns", type=int, default=3)
    options.add_argument("--decades", type=int, default=3)
    options.add_argument("--only", default="toppra,copp,topp3,gcode,opencamlib,freecad")
    args = options.parse_args()
    wanted = args.only.split(",")
    found, (crate, why) = benches(), crates() if {"copp", "topp3", "gcode"} & set(wanted) else (None, "not asked for")
    if crate is None:
        print(f"SKIPPED copp, gcode: {why}")
    sizes = [10 ** (3 + k) for k in range(args.decades)]
    machine()
    table = Table(args.turns)
    with tempfile.TemporaryDirectory() as folder:
        if "toppra" in wanted:
            peer = [sys.executable, os.path.join(HERE, "compare_toppra.py")]
            if absent("toppra"):
                print("SKIPPED toppra: pip install toppra")
            else:
                schedule(table, "time-optimal arc, toppra", "arc", sizes, found["schedule"], peer, folder)
        if "copp" in wanted and crate:
            schedule(table, "time-optimal arc, copp TOPP2-RA", "arc", sizes, found["schedule"], [crate, "arc"], folder)
        if "topp3" in wanted and crate:
            schedule(table, "jerk on a straight path, copp TOPP3-SOCP", "jerk", sizes, found["schedule"], [crate, "jerk"], folder)
        if "gcode" in wanted and crate:
            parsing(table, [10 * size for size in sizes], found["nc"], crate, folder)
        if "opencamlib" in wanted:
            if absent("opencamlib"):
                print("SKIPPED opencamlib: pip install opencamlib")
            else:
                dropping(table, [40, 126, 400][: args.decades], found["stepover"], folder)
    if "freecad" in wanted:
        print("\nFreeCAD's PathSimulator (removal only; tests/bench/compare_freecad.py, which needs target/release/feedwright):")
        sys.stdout.flush()
        subprocess.run([sys.executable, os.path.join(HERE, "compare_freecad.py")], cwd=ROOT)


if __name__ == "__main__":
    main()
