#!/usr/bin/env python3
"""Removal of a program's moves by FreeCAD's headless PathSimulator beside Feedwright's engagement stage, which works out the
engaged arcs as well: both read the same moves, the same ball, the same block and cells of the same width. Two programs: the
bear of the corpus, cut from the full block in cells of 0.2 mm, and the finishing of a wavy face in blocks of 0.24 mm with a
6 mm ball in cells of 0.1 mm.

    cargo build --release
    tests/bench/compare_freecad.py [../shared/programs/camotics_bear.nc]

Without FreeCAD's Python modules it says so and compares nothing (Debian: apt-get install freecad-python3; FREECAD_LIB names
the folder that holds FreeCAD.so). Prints moves per second of both. FreeCAD hands back meshes and no volume:
what is left is not compared."""
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

BINARY = os.environ.get("FEEDWRIGHT", "target/release/feedwright")


@dataclass
class Case:
    """What is cut, with a ball of what diameter, in cells of what width, from what block, mm."""

    name: str
    program: str
    diameter: float
    cell: float
    block: tuple


SETUP = """
[machine]
dialect = "generic"
rapid = 15000
[machine.axes]
x = {{ velocity = 15000, acceleration = 1500 }}
y = {{ velocity = 15000, acceleration = 1500 }}
z = {{ velocity = 15000, acceleration = 1500 }}
[stock]
material = "aluminium-6061-t6"
box = {{ min = {low}, max = {high} }}
[[tool]]
number = {tool}
shape = "ball"
diameter = {diameter}
flutes = 2
flute_length = 40
overhang = 50
"""


def wavy_face(path):
    """Writes the finishing of a face 60 × 40 mm whose height changes by 0.2 mm either way: rows 0.25 mm apart."""
    words = ["G21 G90 G17", "T1 M6", "S12000 M3", "F1500", "G0 X0 Y0 Z5"]
    for row in range(161):
        columns = range(251) if row % 2 == 0 else range(250, -1, -1)
        for x, y in ((0.24 * column, 0.25 * row) for column in columns):
            words.append(f"G1 X{x:.3f} Y{y:.3f} Z{-0.5 + 0.2 * math.sin(0.2 * x) * math.cos(0.15 * y):.4f}")
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(words + ["G0 Z5", "M30", ""]))


def freecad():
    """FreeCAD's modules, or None and why not."""
    places = [os.environ.get("FREECAD_LIB"), "/usr/lib/freecad-python3/lib", "/usr/lib/freecad/lib", "/usr/lib/freecad"]
    sys.path += [place for place in places if place and os.path.isdir(place)]
    sys.path += [os.path.join(os.path.dirname(p), "Mod", "Path") for p in sys.path if "freecad" in p.lower()]
    try:
        import FreeCAD
        import Part
        import Path
        import PathSimulator
    except ImportError as why:
        return None, str(why)
    return (FreeCAD, Part, Path, PathSimulator), ""


def feedwright(case, tool):
    """The report of a simulation."""
    low, high = map(list, case.block)
    with tempfile.TemporaryDirectory() as folder:
        setup, report = os.path.join(folder, "s.toml"), os.path.join(folder, "r.json")
        with open(setup, "w", encoding="utf-8") as file:
            file.write(SETUP.format(low=low, high=high, tool=tool, diameter=case.diameter))
        words = ["simulate", case.program, "--setup", setup, "--resolution", str(case.cell), "--timings", "--json", report, "--quiet"]
        done = subprocess.run([BINARY] + words, capture_output=True, text=True)
        if not os.path.exists(report):
            sys.exit(done.stderr)
        with open(report, encoding="utf-8") as file:
            return json.load(file)


def motions(program):
    done = subprocess.run([BINARY, "toolpath", program], capture_output=True, text=True)
    rows = [line.split() for line in done.stdout.splitlines()]
    tool = next((int(row[2]) for row in rows if row[1] == "tool"), 1)
    return tool, [(row[1], [float(word) for word in row[2:5]]) for row in rows if row[1] in ("rapid", "feed")]


def simulated(modules, case, moves):
    """Seconds of FreeCAD's simulator."""
    FreeCAD, Part, Path, PathSimulator = modules
    low, high = (FreeCAD.Vector(*corner) for corner in case.block)
    stock = Part.makeBox(*(high - low), low)
    radius = 0.5 * case.diameter
    ball = Part.makeSphere(radius, FreeCAD.Vector(0, 0, radius))
    tool = ball.fuse(Part.makeCylinder(radius, 40.0, FreeCAD.Vector(0, 0, radius)))
    simulator = PathSimulator.PathSim()
    simulator.BeginSimulation(stock, case.cell)
    simulator.SetToolShape(tool, case.cell)
    place = FreeCAD.Placement(FreeCAD.Vector(0.0, 0.0, 5.0), FreeCAD.Rotation())
    names = {"rapid": "G0", "feed": "G1"}
    commands = [Path.Command(names[kind], {"X": x, "Y": y, "Z": z}) for kind, (x, y, z) in moves]
    begin = time.perf_counter()
    for command in commands:
        place = simulator.ApplyCommand(place, command)
    return time.perf_counter() - begin


def compare(case, modules):
    """One program through both."""
    tool, moves = motions(case.program)
    report = feedwright(case, tool)
    seconds, left = report["performance"]["stage_s"]["simulate"], report["stock"]["remaining_mm3"]
    print(f"{case.name}: {len(moves)} moves, cell {case.cell} mm")
    print(f"  Feedwright: {len(moves) / seconds:.0f} moves/s with engagement, left {left:.0f} mm³")
    if modules:
        other = simulated(modules, case, moves)
        print(f"  FreeCAD:    {len(moves) / other:.0f} moves/s, removal only; Feedwright takes {seconds / other:.2f} times as long")


def main():
    bear = sys.argv[1] if len(sys.argv) > 1 else "../shared/programs/camotics_bear.nc"
    modules, why = freecad()
    if modules is None:
        print(f"SKIPPED: no FreeCAD here, nothing is compared ({why})")
    if os.path.exists(bear):
        compare(Case("bear", bear, 3.175, 0.2, ((0.0, 0.0, -20.0), (80.0, 80.0, 0.0))), modules)
    else:
        print(f"SKIPPED: {bear} is not there")
    with tempfile.TemporaryDirectory() as folder:
        face = os.path.join(folder, "face.nc")
        wavy_face(face)
        compare(Case("wavy face", face, 6.0, 0.1, ((0.0, 0.0, -10.0), (60.0, 40.0, 0.0))), modules)


main()
