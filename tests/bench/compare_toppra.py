#!/usr/bin/env python3
"""The exact pass against toppra (PyPI) on one arc: same grid, same axis limits, same optimum?

    pip install toppra
    cargo bench --bench schedule -- /tmp/arc.csv
    tests/bench/compare_toppra.py /tmp/arc.csv

Prints both times of travel, the largest difference of speed, and the ratio of computing times."""
import csv
import sys
import time

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint as constraint
from toppra.interpolator import AbstractGeometricPath


class Circle(AbstractGeometricPath):
    """Arc length s on a circle about the origin."""

    def __init__(self, radius, length):
        self.radius, self.length = radius, length

    def __call__(self, s, order=0):
        r, a = self.radius, np.asarray(s) / self.radius
        value = {0: (r * np.cos(a), r * np.sin(a)), 1: (-np.sin(a), np.cos(a)), 2: (-np.cos(a) / r, -np.sin(a) / r)}
        return np.stack(value[order], axis=-1)

    @property
    def dof(self):
        return 2

    @property
    def path_interval(self):
        return np.array([0.0, self.length])

    @property
    def waypoints(self):
        return None


def main():
    lines = open(sys.argv[1]).read().splitlines()
    words = lines[0].split()
    value = {words[i]: float(words[i + 1]) for i in range(1, len(words) - 1, 2)}
    rows = [(float(row["s"]), float(row["b"])) for row in csv.DictReader(lines[1:])]
    s, ours = np.array(rows).T
    path = Circle(value["radius"], s[-1])
    v, a = value["velocity"], value["acceleration"]
    limits = [
        constraint.JointVelocityConstraint(np.array([[-v, v]] * 2)),
        constraint.JointAccelerationConstraint(
            np.array([[-a, a]] * 2), discretization_scheme=constraint.DiscretizationType.Interpolation
        ),
    ]
    solver = toppra.algorithm.TOPPRA(limits, path, gridpoints=s, solver_wrapper="seidel")
    begin = time.perf_counter()
    _, speed, _, = solver.compute_parameterization(0, 0)[:3]
    theirs_s = time.perf_counter() - begin
    travel = lambda v: float(np.sum(2 * np.diff(s) / (v[1:] + v[:-1])))
    ours_v = np.sqrt(ours)
    print(f"travel: ours {travel(ours_v):.6f} s, toppra {travel(speed):.6f} s")
    print(f"largest difference of speed {np.max(np.abs(ours_v - speed)):.2e} mm/s of {np.max(speed):.2f}")
    print(f"RESULT {theirs_s} speeds within {np.max(np.abs(ours_v - speed)) / np.max(speed):.1e} of the largest")
    print(f"computing: ours {value['seconds'] * 1e3:.2f} ms, toppra {theirs_s * 1e3:.2f} ms, ratio {theirs_s / value['seconds']:.1f}")


if __name__ == "__main__":
    main()
