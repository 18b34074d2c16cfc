#!/usr/bin/env python3
"""One program, one setup, four ways to choose feeds, each written as a program and simulated again by the same model:
(a) as programmed, (b) the least of the limits in each block, changed only by more than a threshold, (c) the material-removal-rate
rule, (d) Feedwright.

    cargo build --release
    tests/bench/compare_rules.py programs/pocket.nc [SETUP.toml]

(b) takes the same caps as (d), block by block, and keeps the last feed while it is within 10 % below the new one. (c) scales the
programmed feed of a block by reference rate / rate, between the same feed_change limits; its reference is the removal rate at
which the load nearest to its limit just meets it (the largest that a user of that rule could justify for this program). Feeds
of (b) and (c) are written as F words of whole blocks; none of them splits. Prints a table in Markdown."""
import csv
import json
import os
import re
import subprocess
import sys
import tempfile

BINARY = os.environ.get("FEEDWRIGHT", "target/release/feedwright")
THRESHOLD = 0.10
CHANGE = (0.2, 2.0)


def run(words):
    done = subprocess.run([BINARY] + words, capture_output=True, text=True)
    if done.returncode == 2:
        sys.exit(done.stderr)
    return done.stdout


def simulated(program, setup, folder, command="simulate", more=()):
    report, rows = os.path.join(folder, "r.json"), os.path.join(folder, "r.csv")
    run([command, program, "--setup", setup, "--json", report, "--csv", rows, "--quiet", "--force", *more])
    return json.load(open(report)), list(csv.DictReader(open(rows)))


def caps(program, setup):
    """Least cap, programmed feed and length of each block (line) in cuts, and the lines whose feed is free."""
    rows = list(csv.DictReader(run(["dump", "problem", program, "--setup", setup, "--quiet"]).splitlines(), delimiter="\t"))
    least, programmed, fixed = {}, {}, set()
    for row in rows:
        line = int(row["line"])
        if row["free"] != "true":
            fixed.add(line)
        least[line] = min(least.get(line, float("inf")), float(row["cap"]))
        programmed[line] = float(row["programmed"])
    return {line: (cap, programmed[line]) for line, cap in least.items() if line not in fixed and programmed[line] > 0}


def with_feeds(text, feeds, unit):
    """The text with an F word in every block of `feeds` (line → mm/min), and the programmed feed restated where it ends."""
    out, F = [], re.compile(r"F\s*[-+.0-9]+", re.I)
    last, words = None, 0
    for number, line in enumerate(text.splitlines(), 1):
        code = line.split("(")[0]
        if number in feeds and re.search(r"[XYZIJKR]\s*[-+.0-9]", code, re.I):
            feed = feeds[number] / unit
            value = f"F{int(feed * 10) / 10}"
            line = F.sub("", line)
            if value != last:
                line, last, words = line.rstrip() + " " + value, value, words + 1
        elif F.search(code):
            last, words = None, words + 1
        out.append(line)
    return "\n".join(out) + "\n", words


def ratios(report, rows):
    """Worst and 99th percentile (over the cut length) of load / limit of a simulation."""
    names = {"force_xy": "force_xy_peak_n", "force_normal_mean": "force_normal_mean_n", "force_axial": "force_axial_peak_n",
             "power": "power_w", "torque": "torque_nm", "deflection": "deflection_mm", "chip_thickness": "chip_thickness_max_mm"}
    limits = {}
    for one in report["limits"]:
        if one["limit"] and one["name"] in names:
            limits.setdefault(one["tool"], {})[names[one["name"]] + "_before"] = one["limit"]
    found = []
    for row, after in zip(rows, rows[1:] + rows[-1:]):
        same = after["motion"] == row["motion"]
        length = float(after["s_mm"]) - float(row["s_mm"]) if same else 0.0
        mine = limits.get(int(row["tool"]), limits.get(None, {}))
        loads = [float(row[name] or 0) / limit for name, limit in mine.items() if name in row]
        if float(row["removal_area_mm2"] or 0) > 0 and loads:
            found.append((max(loads), max(length, 1e-9)))
    found.sort()
    whole, below, p99 = sum(length for _, length in found), 0.0, 0.0
    for value, length in found:
        below += length
        p99 = value
        if below >= 0.99 * whole:
            break
    return (found[-1][0] if found else 0.0), p99


def by_least(program_caps):
    feeds, last = {}, None
    for line, (cap, _) in sorted(program_caps.items()):
        if last is None or cap < last or cap > last * (1 + THRESHOLD):
            last = cap
        feeds[line] = last
    return feeds


def by_removal_rate(program_caps, rows, reference_share):
    area = {}
    for row in rows:
        line = int(row["line"])
        area[line] = max(area.get(line, 0.0), float(row["removal_area_mm2"] or 0))
    reference = max(area.get(line, 0) * programmed for line, (_, programmed) in program_caps.items()) * reference_share
    feeds = {}
    for line, (_, programmed) in program_caps.items():
        rate = area.get(line, 0) * programmed
        change = min(max(reference / rate, CHANGE[0]), CHANGE[1]) if rate > 0 else 1.0
        feeds[line] = programmed * change
    return feeds


def main():
    program = sys.argv[1]
    setup = sys.argv[2] if len(sys.argv) > 2 else os.path.splitext(program)[0] + ".setup.toml"
    text = open(program, encoding="latin-1").read()
    unit = 25.4 if re.search(r"\bG20\b", text) else 1.0
    with tempfile.TemporaryDirectory() as folder:
        def judge(name, text, words):
            path = os.path.join(folder, "part.nc")
            open(path, "w", encoding="latin-1").write(text)
            report, rows = simulated(path, setup, folder)
            worst, p99 = ratios(report, rows)
            return [name, f"{report['time']['realised_before_s']:.1f}", f"{worst:.3f}", f"{p99:.3f}", str(words)]

        known = caps(program, setup)
        before, rows = simulated(program, setup, folder)
        worst, _ = ratios(before, rows)
        table = [judge("as programmed", text, len(re.findall(r"F\s*[-+.0-9]+", re.sub(r"\(.*?\)", "", text))))]
        table.append(judge("least limit per block, threshold", *with_feeds(text, by_least(known), unit)))
        # The reference rate: halved or raised until the heaviest block just meets its limit.
        low, high = 0.0, 1.0 / max(worst, 1e-9) * 4
        for _ in range(12):
            middle = 0.5 * (low + high)
            new, _ = with_feeds(text, by_removal_rate(known, rows, middle), unit)
            path = os.path.join(folder, "try.nc")
            open(path, "w", encoding="latin-1").write(new)
            low, high = (middle, high) if ratios(*simulated(path, setup, folder))[0] <= 1.0 else (low, middle)
        table.append(judge("removal rate, heaviest place at its limit", *with_feeds(text, by_removal_rate(known, rows, low), unit)))
        out = os.path.join(folder, "part.fw.nc")
        run(["optimize", program, "--setup", setup, "-o", out, "--json", os.path.join(folder, "o.json"), "--quiet", "--force"])
        found = json.load(open(os.path.join(folder, "o.json")))
        table.append(judge("Feedwright", open(out, encoding="latin-1").read(), found["output"]["f_words_after"]))
        # The time of the continuous optimum, which no F words reach; below it only feeds that break a limit get.
        least = found["time"]["realised_after_s"] / (1 + 0.01 * found["output"]["loss_vs_continuous_percent"])
        for row in table:
            row.append(f"{100 * (float(row[1]) / least - 1):+.1f} %")
    head = ["feeds by", "time, s", "worst load / limit", "99 % below", "F words", "over the continuous optimum"]
    for row in [head, ["---"] * len(head)] + table:
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
