#!/usr/bin/env python3
"""Board over NC programs that nobody tuned to.

    tests/bench/board.py FOLDER [--feedwright target/release/feedwright] [--seconds 60] [--csv BOARD.csv]

FOLDER holds the programs (any post, any control); none of them belongs to the project: held_out_programs.csv beside this file
lists those that were used (repository, path, commit, sha256 of the text). For every program the script writes a plausible setup
from its extent (a box around its feed motions, one flat end mill for every tool it calls), runs `optimize`, `verify`, `simulate`
and a second `optimize` on the written file, reads the original by LinuxCNC's rs274 where that can read it, and prints one line:

    read      written and proven, or kept as it is, and nothing below happened
    refused   exit 2 with a sentence, nothing written
    wrong     one of: a crash; more than --seconds; a turning program rewritten; a feed raised behind something the simulation
              cannot know (rotary axes, tilted planes, a missing subprogram, a pallet, values only the control has); exit 0 with a load
              above its limit; `verify` fails; motions other than rs274's; a second run that changes more than 1 % of the lines

Exit code 1 if any is wrong.
"""

import argparse
import csv
import difflib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

INCH = 25.4
FORCE_N = 300.0  # a load limit that binds on some programs and not on others
SLACK = 1.01  # what the project promises: no load above 1.01 of its limit
SECOND_RUN = 0.01  # share of lines a second run may change
NEAR_MM = 2e-3  # rs274 prints 4 decimals; arcs may end that far from where the text says

COMMENTS = re.compile(r"\([^)]*\)|;.*")
TURNING = re.compile(r"\bG96\b|\bG50\s*S|\bG7[0-6]\s*[PUW]|\bG32\b|^\s*(?:N\d+\s*)?T\d{4}\b", re.M)
# Words behind which the part, the frame or the values are not known from the text alone.
UNKNOWN = re.compile(
    r"\bTRAORI\b|\bCYCLE800\s*\(\s*[^)\s]|\bG68\.2\b|\bG43\.[45]\b|\bPLANE\s+SPATIAL\b|\bM128\b|\bM60\b|SYSREAD"
    r"|\b[ABC]=?-?(?=[\d.]*[1-9])[\d.]+|\bG38\.\d\b|\bG10\s*L2"
)


def run(command, seconds):
    """Exit code, output, errors, seconds; exit code None where the time ran out."""
    start = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return None, b"", b"", time.monotonic() - start
    return done.returncode, done.stdout, done.stderr, time.monotonic() - start


def crashed(code, errors):
    return code is not None and (code < 0 or code > 2 or b"panicked" in errors)


def sentence(errors):
    """The first message of the program itself, without its frame."""
    lines = errors.decode("utf-8", "replace").splitlines()
    found = [line for line in lines if line.startswith(("error", "warning"))]
    return (found or lines or ["nothing said"])[0][:110]


def setup(motions, text):
    """A setup from what the program does: box around its feed motions, one end mill for every tool it calls."""
    inch = bool(re.search(r"\bG20\b|\bG70\b|\bPGM\b.*\bINCH\b", text))
    diameter = 0.5 * INCH if inch else 6.0
    cuts = [m["to"] for m in motions if m["kind"] in ("feed", "arc")]
    for before, m in zip([None] + motions[:-1], motions):
        if m["kind"] == "arc" and m.get("centre") and before and before.get("to"):
            radius = max(abs(a - b) for a, b in zip(m["to"], m["centre"]))
            cuts += [[c + s * radius for c in m["centre"][:2]] + [m["to"][2]] for s in (-1, 1)]
    cuts = cuts or [[0.0, 0.0, -1.0], [10.0, 10.0, 0.0]]
    low, high = ([f(p[k] for p in cuts) for k in range(3)] for f in (min, max))
    top = 0.0 if low[2] < 0.0 < high[2] else max(high[2] - 1.0, low[2] + 1.0)
    tools = sorted({int(m["value"]) for m in motions if m["kind"] == "tool"}) or [1]
    names = list(dict.fromkeys(re.findall(r'(?:\bT=|TOOL CALL\s*)"([^"]+)"', text)))
    named = {name: 900 + k for k, name in enumerate(names)}
    lines = ["[machine]"]
    if named:
        lines.append("tool_names = { " + ", ".join(f'"{n}" = {k}' for n, k in named.items()) + " }")
    box = [[low[k] - diameter for k in (0, 1)] + [min(low[2], top) - 5.0], [high[k] + diameter for k in (0, 1)] + [top]]
    lines += ["[stock]", 'material = "aluminium"', f"box = {{ min = {box[0]}, max = {box[1]} }}"]
    for number in dict.fromkeys(tools + list(named.values())):
        lines += ["[[tool]]", f"number = {number}", 'shape = "flat"', f"diameter = {diameter}", "flutes = 2",
                  'material = "carbide"', f"overhang = {4 * diameter}"]
    return "\n".join(lines + ["[limits]", f"force_xy = {FORCE_N}", ""])


def raised_behind_unknown(text, blocks):
    """First line behind an unknown word whose feed went up."""
    first = None
    for number, line in enumerate(text.splitlines(), 1):
        if UNKNOWN.search(COMMENTS.sub("", line)):
            first = number
            break
    if first is None:
        return None
    for block in blocks:
        if block["line"] >= first and block["feed_after"] > block["feed_before"] * (1 + 1e-6):
            return f"line {block['line']}: {block['feed_before']:.0f} → {block['feed_after']:.0f} behind line {first}"
    return None


def rs274_points(rs274, path, folder):
    """End points of the motions as LinuxCNC reads them, mm; None where it does not read the text."""
    table, parameters = os.path.join(folder, "tools.tbl"), os.path.join(folder, "rs.var")
    with open(table, "w", encoding="ascii") as out:
        out.writelines(f"T{k} P{k} Z0 D0.2362 ;\n" for k in range(1, 100))
    code, out, _, _ = run([rs274, "-g", "-n", "2", "-t", table, "-v", parameters, path], 30)
    if code != 0:
        return None
    points, scale = [], 1.0
    for line in out.decode("latin-1").splitlines():
        found = re.search(r"(USE_LENGTH_UNITS|STRAIGHT_TRAVERSE|STRAIGHT_FEED)\((.*?)\)", line)
        if not found:
            continue
        name, given = found.groups()
        if name == "USE_LENGTH_UNITS":
            scale = INCH if "INCH" in given else 1.0
        else:
            points.append([scale * float(x) for x in given.split(",")[:3]])
    return points


def straight_points(motions):
    return [m["to"] for m in motions if m["kind"] in ("rapid", "feed")]


def distinct(points):
    out = []
    for p in points:
        if not out or max(abs(a - b) for a, b in zip(out[-1], p)) > NEAR_MM:
            out.append(p)
    return out


def other_motions(rs274, feedwright, path, folder):
    """A sentence where the straight motions, read as LinuxCNC's language, are not rs274's."""
    theirs = rs274_points(rs274, path, folder)
    if theirs is None:
        return None
    code, out, _, _ = run([feedwright, "toolpath", path, "--json", "-", "--dialect", "linuxcnc"], 60)
    if code != 0:
        return None
    theirs, ours = distinct(theirs), distinct(straight_points(json.loads(out)["motions"]))
    for k, (a, b) in enumerate(zip(theirs, ours)):
        if max(abs(x - y) for x, y in zip(a, b)) > NEAR_MM:
            return f"rs274: straight motion {k + 1} ends at {a}, here at {[round(v, 4) for v in b]}"
    return None if len(theirs) == len(ours) else f"rs274: {len(theirs)} straight motions, here {len(ours)}"


def judge(path, feedwright, rs274, seconds, folder):
    """(verdict, reason, seconds) of one program."""
    name = os.path.basename(path)
    text = open(path, encoding="latin-1").read()
    code, out, errors, _ = run([feedwright, "toolpath", path, "--json", "-"], seconds)
    if code is None or crashed(code, errors):
        return "wrong", f"toolpath: {'too long' if code is None else sentence(errors)}", seconds
    if code == 2:
        return "refused", sentence(errors), 0.0
    motions = json.loads(out)["motions"]
    written, again = (os.path.join(folder, f"{k}-{name}") for k in ("first", "second"))
    settings, report, after = (os.path.join(folder, f) for f in ("setup.toml", "report.json", "after.json"))
    with open(settings, "w", encoding="utf-8") as file:
        file.write(setup(motions, text))
    common = ["--setup", settings, "--force"]
    code, _, errors, took = run([feedwright, "optimize", path, "-o", written, "--json", report, "--json-blocks"] + common, seconds)
    if code is None:
        return "wrong", f"optimize takes more than {seconds} s", took
    if crashed(code, errors):
        return "wrong", f"optimize crashed: {sentence(errors)}", took
    if code == 2:
        return "refused", sentence(errors), took
    # The script's own judgement of lathe programs: refused, or it is wrong.
    if TURNING.search(COMMENTS.sub("", text)) and not re.search(r"\bY-?\d", text) and os.path.exists(written):
        return "wrong", "a turning program was rewritten", took
    blocks = json.load(open(report, encoding="utf-8")).get("blocks", []) if os.path.exists(report) else []
    if not os.path.exists(written):
        return ("read" if code == 1 else "wrong"), f"exit {code}, nothing written: {sentence(errors)}", took
    raised = raised_behind_unknown(text, blocks)
    if raised:
        return "wrong", f"raised: {raised}", took
    proven, _, errors, _ = run([feedwright, "verify", path, written] + ["--setup", settings], seconds)
    if proven != 0:
        return "wrong", f"verify exit {proven}: {sentence(errors)}", took
    simulated, _, errors, _ = run([feedwright, "simulate", written, "--json", after] + common, seconds)
    if simulated is None or crashed(simulated, errors):
        return "wrong", f"simulate of the written file: {sentence(errors)}", took
    if code == 0 and os.path.exists(after):
        for limit in json.load(open(after, encoding="utf-8")).get("limits", []):
            load = limit.get("before_max") or 0.0
            if limit["name"] == "force_xy" and load > SLACK * FORCE_N:
                return "wrong", f"exit 0 with {load:.0f} N of {FORCE_N:.0f} N", took
    second, _, errors, _ = run([feedwright, "optimize", written, "-o", again] + common, seconds)
    if second is None or crashed(second, errors):
        return "wrong", f"second run: {sentence(errors)}", took
    if os.path.exists(again):
        one, two = (open(f, encoding="latin-1").read().splitlines() for f in (written, again))
        same = sum(block.size for block in difflib.SequenceMatcher(None, one, two, autojunk=False).get_matching_blocks())
        changed = 1.0 - same / max(len(one), len(two), 1)
        if changed > SECOND_RUN:
            return "wrong", f"a second run changes {100 * changed:.1f} % of {len(one)} lines", took
    differs = other_motions(rs274, feedwright, path, folder) if rs274 else None
    if differs:
        return "wrong", differs, took
    return "read", f"exit {code}", took


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--feedwright", default="target/release/feedwright")
    parser.add_argument("--rs274", default=shutil.which("rs274"))
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--csv")
    given = parser.parse_args()
    rows = []
    for name in sorted(os.listdir(given.folder)):
        with tempfile.TemporaryDirectory() as folder:
            verdict, reason, took = judge(os.path.join(given.folder, name), given.feedwright, given.rs274, given.seconds, folder)
        rows.append((name, verdict, reason, f"{took:.1f}"))
        print(f"{verdict:8} {name:28} {took:6.1f} s  {reason}", flush=True)
    count = {word: sum(row[1] == word for row in rows) for word in ("read", "refused", "wrong")}
    print(f"\n{len(rows)} programs: " + ", ".join(f"{n} {word}" for word, n in count.items()))
    if given.csv:
        with open(given.csv, "w", newline="", encoding="utf-8") as out:
            csv.writer(out).writerows([("program", "verdict", "reason", "seconds"), *rows])
    return 1 if count["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
