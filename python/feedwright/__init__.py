"""Feedwright: feeds of NC milling programs by force, power, deflection and chip thickness.

A program, a rewritten program or a log is a path, or its bytes. A setup is the path of a setup file, or its text as bytes (paths in it
then count from the current folder).

>>> found = feedwright.optimize("part.nc", "part.setup.toml")
>>> found.prediction.time_s, found.prediction.headline
>>> loads = found.prediction.stations()["force_xy_peak_n_after"]   # a numpy array, one value per station of the path
>>> if found.program is not None:
...     open("part.fw.nc", "wb").write(found.program)

What cannot be read or simulated is a ValueError that says why. Lengths are mm, feeds mm/min, times s.
"""

import os
import sys

from . import _feedwright
from ._feedwright import Learned, Optimised, Prediction, Proof

__all__ = ["simulate", "optimize", "verify", "learn", "Prediction", "Optimised", "Proof", "Learned", "main"]


def _bytes(given):
    """Bytes as they are; a path as what its file holds."""
    if isinstance(given, (bytes, bytearray, memoryview)):
        return bytes(given)
    with open(given, "rb") as file:
        return file.read()


def _setup(given):
    """Text and folder of a setup."""
    is_path = not isinstance(given, (bytes, bytearray, memoryview))
    folder = os.path.dirname(os.path.abspath(os.fspath(given))) if is_path else "."
    return _bytes(given).decode("utf-8"), folder


def simulate(program, setup, model=None):
    """Loads and times of a program as it stands; `model` is a process model that `learn` or `calibrate` wrote."""
    return _feedwright.simulate(_bytes(program), *_setup(setup), model)


def optimize(program, setup, model=None):
    """A program with new feeds within the limits of the setup, proved to differ in feeds only."""
    return _feedwright.optimize(_bytes(program), *_setup(setup), model)


def verify(original, rewritten, setup=None):
    """Does only the feed differ?"""
    return _feedwright.verify(_bytes(original), _bytes(rewritten), *(_setup(setup) if setup is not None else (None, ".")))


def learn(program, log, setup):
    """What a model lacks, from a log measured while the program ran."""
    return _feedwright.learn(_bytes(program), _bytes(log), *_setup(setup))


def main():
    """The console command: `feedwright optimize part.nc` and all others."""
    sys.exit(_feedwright.main(["feedwright", *sys.argv[1:]]))
