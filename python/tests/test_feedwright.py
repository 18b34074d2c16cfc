"""The wheel against the console command it brings: python -m unittest in this folder, with the wheel installed."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

import feedwright
import numpy

PROGRAM = b"%\nG21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y5 Z2\nG1 Z-2 F300\nG1 X50 F900\nY12\nX-10 F450\nY15\nX50 F1400\nG0 Z10\nM30\n%\n"
SETUP = b"""resolution = 0.5
[machine]
dialect = "linuxcnc"
[stock]
box = { min = [0, 0, -10], max = [40, 20, 0] }
[material]
k_tc = %d
k_te = 14
[[tool]]
number = 1
shape = "flat"
diameter = 6
flutes = 3
[limits]
force_xy = 60
"""


def command(*arguments):
    return subprocess.run([sys.executable, "-m", "feedwright", *arguments], capture_output=True, check=False)


class Wheel(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.program, self.setup = (os.path.join(self.folder.name, name) for name in ("part.nc", "part.setup.toml"))
        for path, text in ((self.program, PROGRAM), (self.setup, SETUP % 800)):
            with open(path, "wb") as file:
                file.write(text)

    def tearDown(self):
        self.folder.cleanup()

    def test_optimize_gives_what_the_command_writes(self):
        found = feedwright.optimize(self.program, self.setup)
        done = command("optimize", self.program, "--json", self.program + ".json")
        self.assertIn(done.returncode, (0, 1), done.stderr)
        with open(os.path.join(self.folder.name, "part.fw.nc"), "rb") as file:
            self.assertEqual(file.read(), found.program)
        with open(self.program + ".json", "rb") as file:
            report = json.load(file)
        self.assertEqual(report["time"]["realised_after_s"], found.prediction.time_s[1])
        self.assertEqual(report["verdict"]["headline"], found.prediction.headline)
        self.assertEqual(found.prediction.ok, done.returncode == 0)
        proof = feedwright.verify(PROGRAM, found.program, self.setup)
        self.assertTrue(proof.holds and proof.feeds_changed > 0)
        self.assertFalse(feedwright.verify(PROGRAM, PROGRAM.replace(b"X50", b"X51")).holds)

    def test_stations_are_arrays_that_agree_with_the_largest_load(self):
        predicted = feedwright.simulate(PROGRAM, SETUP % 800)
        stations = predicted.stations()
        force = stations["force_xy_peak_n_before"]
        self.assertIsInstance(force, numpy.ndarray)
        self.assertEqual(force.dtype, numpy.float64)
        self.assertEqual({len(column) for column in stations.values()}, {len(force)})
        largest = next(load for load in predicted.loads if load["name"] == "force_xy")
        self.assertAlmostEqual(numpy.nanmax(force), largest["before"], delta=1e-3 * largest["before"])
        self.assertTrue(numpy.all(numpy.diff(stations["time_before_s"]) >= 0))

    def test_learn_finds_a_harder_material(self):
        truth = feedwright.simulate(PROGRAM, SETUP % 1000).stations()
        names = ("time_before_s", "x_mm", "y_mm", "z_mm", "spindle_rpm", "power_w_before")
        rows = numpy.column_stack([truth[name] for name in names])
        rows = rows[numpy.isfinite(rows).all(axis=1)]
        times = numpy.arange(rows[0, 0], rows[-1, 0], 0.05)
        log = numpy.column_stack([times] + [numpy.interp(times, rows[:, 0], rows[:, k]) for k in range(1, 6)])
        path = os.path.join(self.folder.name, "log.csv")
        head = "time_s,x_mm,y_mm,z_mm,spindle_rpm,spindle_power_w"
        numpy.savetxt(path, log, delimiter=",", header=head, comments="", fmt="%.4f")
        learned = feedwright.learn(self.program, path, self.setup)
        found = learned.coefficients
        self.assertIsInstance(found["value"], numpy.ndarray)
        self.assertAlmostEqual(found["value"][found["name"].index("k_tc")], 1000.0, delta=30.0)
        feedwright.optimize(self.program, self.setup, model=learned.model)

    def test_what_cannot_be_done_is_said(self):
        with self.assertRaisesRegex(ValueError, "bux"):
            feedwright.simulate(PROGRAM, b"[stock]\nbux = 1\n")
        with self.assertRaisesRegex(ValueError, "T5"):
            feedwright.simulate(b"T5 M6\nS3000 M3\nG1 X10 F500\nM30\n", SETUP % 800)
        with self.assertRaises(FileNotFoundError):
            feedwright.simulate("none.nc", self.setup)
        done = command("optimize", "none.nc")
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"none.nc", done.stderr)
        self.assertIn(b"feedwright", command("--version").stdout)


if __name__ == "__main__":
    unittest.main()
