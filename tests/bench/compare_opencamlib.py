#!/usr/bin/env python3
"""Drop-cutter against opencamlib (PyPI): same mesh, same tools, same places.

    pip install opencamlib
    cargo bench --bench stepover -- /tmp/drop
    tests/bench/compare_opencamlib.py /tmp/drop

Prints the largest difference of height and the ratio of points a second over at most 5,000 of the places (it makes its tree
within the run; ours is made before); a difference above 1 micrometre is exit code 1."""
import struct
import sys
import time

import opencamlib as ocl


def surface(path):
    data = open(path, "rb").read()
    mesh = ocl.STLSurf()
    for k in range(struct.unpack_from("<I", data, 80)[0]):
        c = struct.unpack_from("<9f", data, 84 + 50 * k + 12)
        mesh.addTriangle(ocl.Triangle(ocl.Point(*c[0:3]), ocl.Point(*c[3:6]), ocl.Point(*c[6:9])))
    return mesh


def cutter(radius, corner):
    if corner == 0:
        return ocl.CylCutter(2 * radius, 50)
    return ocl.BallCutter(2 * radius, 50) if corner == radius else ocl.BullCutter(2 * radius, corner, 50)


def main():
    folder = sys.argv[1]
    names = sys.argv[2:] or ["ball", "bull", "flat"]
    mesh = surface(f"{folder}/mould.stl")
    bad = False
    for name in names:
        lines = open(f"{folder}/{name}.csv").read().splitlines()
        _, _, radius, corner, ours_s, count = lines[1].split()
        rows = [tuple(map(float, line.split(","))) for line in lines[2:]]
        rows = rows[:: max(1, len(rows) // 5000)]
        tool = cutter(float(radius), float(corner))  # opencamlib keeps no reference to it
        drop = ocl.BatchDropCutter()
        drop.setSTL(mesh)
        drop.setCutter(tool)
        for x, y, _ in rows:
            drop.appendPoint(ocl.CLPoint(x, y, -1e3))
        begin = time.perf_counter()
        drop.run()
        theirs_s = time.perf_counter() - begin
        apart = [abs(row[2] - point.z) for row, point in zip(rows, drop.getCLPoints())]
        far = max(apart)
        over = sum(a > 1e-3 for a in apart)
        bad |= over > 0
        ours, theirs = int(count) / float(ours_s), len(rows) / theirs_s
        print(f"{name}: {len(rows)} places, largest difference {far * 1e3:.4f} um, {over} above 1 um; "
              f"{ours:.0f} points/s here, {theirs:.0f} there, ratio {ours / theirs:.0f}")
        print(f"RESULT {theirs_s / len(rows) * 5000} heights within {far * 1e3:.1g} um")
    return bad


if __name__ == "__main__":
    sys.exit(main())
