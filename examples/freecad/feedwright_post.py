"""Post-processing step for FreeCAD CAM: another post writes the program, Feedwright chooses its feeds.

Put this file into FreeCAD's macro folder; it then stands among the posts of a job as "feedwright". Arguments of the post:

    --post=linuxcnc       the post that writes the program (default: linuxcnc)
    --setup=FILE.toml     Feedwright's setup; without it NAME.setup.toml beside the program
    --feedwright=PATH     the program feedwright, where it is not in the PATH (or the variable FEEDWRIGHT)
    anything else         goes to the post that writes the program

NAME.nc is the program as the post wrote it, with a line for each tool above it; NAME.fw.nc beside it is the one with the new feeds.
"""

import argparse
import importlib
import os
import shlex
import subprocess

TOOLTIP = "Writes the program with another post, then lets Feedwright choose its feeds."
TOOLTIP_ARGS = "--post=linuxcnc --setup=FILE.toml --feedwright=PATH, and arguments of that post"

# Shapes of FreeCAD's tool bits in words that Feedwright reads; the others are left to the setup.
SHAPES = {"endmill": "FLAT END MILL", "ballend": "BALL END MILL", "drill": "DRILL"}


def base_post(name):
    """The post that writes the program: FreeCAD 1.0 keeps its own in a package, older ones and macros stand alone."""
    for module in (f"Path.Post.scripts.{name}_post", f"{name}_post"):
        try:
            return importlib.import_module(module)
        except ImportError:
            continue
    raise ValueError(f"there is no post named {name}")


def tool_comments(objects):
    """A comment for each tool controller among the objects, like (T1 6 MM FLAT END MILL, 3 FLUTES)."""
    lines = {}
    for controller in objects:
        bit, number = getattr(controller, "Tool", None), getattr(controller, "ToolNumber", None)
        shape = str(getattr(bit, "ShapeName", "")).lower()
        if number is None or shape not in SHAPES:
            continue
        diameter = getattr(bit.Diameter, "Value", bit.Diameter)
        flutes = int(getattr(bit, "Flutes", 0) or 0)
        words = f"T{number} {float(diameter):g} MM {SHAPES[shape]}" + (f", {flutes} FLUTES" if flutes else "")
        lines[number] = f"({words})"
    return [lines[number] for number in sorted(lines)]


def with_comments(program, comments):
    """The program with the comments above it, below the % of a tape."""
    first, rest = program.split("\n", 1) if program.startswith("%") else (None, program)
    return "\n".join(([first] if first is not None else []) + comments + [rest])


def say(text):
    try:
        import FreeCAD

        FreeCAD.Console.PrintMessage(text + "\n")
    except ImportError:
        print(text)


def export(objectslist, filename, argstring):
    """What FreeCAD calls: writes the program and what Feedwright made of it, and returns the latter."""
    parser = argparse.ArgumentParser(prog="feedwright", add_help=False)
    parser.add_argument("--post", default="linuxcnc")
    parser.add_argument("--setup")
    parser.add_argument("--feedwright", default=os.environ.get("FEEDWRIGHT", "feedwright"))
    own, others = parser.parse_known_args(shlex.split(argstring or ""))
    program = base_post(own.post).export(objectslist, "-", shlex.join(others + ["--no-show-editor"]))
    program = with_comments(program, tool_comments(objectslist))
    with open(filename, "w", encoding="utf-8", newline="\n") as file:
        file.write(program)
    stem, ending = os.path.splitext(filename)
    written = f"{stem}.fw{ending}"
    command = [own.feedwright, "optimize", filename, "-o", written] + (["--setup", own.setup] if own.setup else [])
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    say((done.stdout + done.stderr).strip())
    # 0: every limit is met; 1: written, but one is not met somewhere, or held back; 2: something is missing, and nothing was written.
    if done.returncode > 1 or not os.path.exists(written):
        raise RuntimeError(f"Feedwright wrote no program; {filename} has the feeds of the job.\n{done.stderr.strip()}")
    with open(written, encoding="utf-8", newline="") as file:
        return file.read()
