#!/usr/bin/env python3
"""Removal of a program's moves by FreeCAD's headless PathSimulator beside Feedwright's engagement stage, which works out the
engaged arcs as well: both read the same moves, the same ball and the same block, in cells of 0.2 mm.

    cargo build --release
    tests/bench/compare_freecad.py [../shared/programs/camotics_bear.nc]

Without FreeCAD's Python modules it says so and compares nothing (Debian: apt-get install freecad-python3; FREECAD_LIB names
the folder that holds FreeCAD.so). Prints moves per second of both. FreeCAD hands back meshes and no volume:
what is left is not compared."""
import json
import os
import subprocess
import sys
import tempfile
import time

BINARY = os.environ.get("FEEDWRIGHT", "target/release/feedwright")
CELL_MM = 0.2
DIAMETER_MM = 3.175
BLOCK = ((0.0, 0.0, -20.0), (80.0, 80.0, 0.0))
SETUP = f"""
[machine]
dialect = "generic"
rapid = 15000
[machine.axes]
x = {{ velocity = 15000, acceleration = 1500 }}
y = {{ velocity = 15000, acceleration = 1500 }}
z = {{ velocity = 15000, acceleration = 1500 }}
[stock]
material = "aluminium-6061-t6"
box = {{ min = {list(BLOCK[0])}, max = {list(BLOCK[1])} }}
[[tool]]
number = %d
shape = "ball"
diameter = {DIAMETER_MM}
flutes = 2
flute_length = 40
overhang = 50
"""


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


def feedwright(program, tool):
    """The report of a simulation."""
    with tempfile.TemporaryDirectory() as folder:
        setup, report = os.path.join(folder, "s.toml"), os.path.join(folder, "r.json")
        with open(setup, "w", encoding="utf-8") as file:
            file.write(SETUP % tool)
        words = ["simulate", program, "--setup", setup, "--resolution", str(CELL_MM), "--timings", "--json", report, "--quiet"]
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


def simulated(modules, moves):
    """Seconds of FreeCAD's simulator."""
    FreeCAD, Part, Path, PathSimulator = modules
    low, high = (FreeCAD.Vector(*corner) for corner in BLOCK)
    stock = Part.makeBox(*(high - low), low)
    radius = 0.5 * DIAMETER_MM
    ball = Part.makeSphere(radius, FreeCAD.Vector(0, 0, radius))
    tool = ball.fuse(Part.makeCylinder(radius, 40.0, FreeCAD.Vector(0, 0, radius)))
    simulator = PathSimulator.PathSim()
    simulator.BeginSimulation(stock, CELL_MM)
    simulator.SetToolShape(tool, CELL_MM)
    place = FreeCAD.Placement(FreeCAD.Vector(0.0, 0.0, 5.0), FreeCAD.Rotation())
    names = {"rapid": "G0", "feed": "G1"}
    commands = [Path.Command(names[kind], {"X": x, "Y": y, "Z": z}) for kind, (x, y, z) in moves]
    begin = time.perf_counter()
    for command in commands:
        place = simulator.ApplyCommand(place, command)
    return time.perf_counter() - begin


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else "../shared/programs/camotics_bear.nc"
    if not os.path.exists(program):
        print(f"SKIPPED: {program} is not there")
        return
    tool, moves = motions(program)
    report = feedwright(program, tool)
    seconds = report["performance"]["stage_s"]["simulate"]
    print(f"Feedwright: {len(moves)} moves, {len(moves) / seconds:.0f} moves/s with engagement, left {report['stock']['remaining_mm3']:.0f} mm³")
    modules, why = freecad()
    if modules is None:
        print(f"SKIPPED: no FreeCAD here, nothing is compared ({why})")
        return
    other = simulated(modules, moves)
    print(f"FreeCAD:    {len(moves)} moves, {len(moves) / other:.0f} moves/s, removal only")
    print(f"Feedwright takes {seconds / other:.2f} times as long")


main()
