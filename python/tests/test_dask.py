"""`feedwright batch` over the workers of a Dask cluster, one of them killed midway: the same bytes as a run that nothing disturbs, and
nothing twice. Needs `distributed` (PyPI) and the wheel, or the command in FEEDWRIGHT."""

import logging
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "examples" / "dask"))

import batch as example  # noqa: E402

try:
    import psutil
    from distributed import Client, LocalCluster
except ImportError:
    Client = None

COMMAND = shlex.split(os.environ.get("FEEDWRIGHT", "")) or [sys.executable, "-m", "feedwright"]
SHARDS = 3
# The shard whose worker is lost, while its second program is under way.
LOST = 2
# Programs of `programs/`, each with the line of its setup that is changed and what it becomes: one program for every shard. The
# second takes long enough to be met under way.
PROGRAMS = (
    ("calibration.ngc", "power = 3500", ("power = 3500", "power = 3000", "power = 2500")),
    ("pocket.nc", "force_xy = 450", ("force_xy = 450", "force_xy = 400", "force_xy = 350")),
    ("calibration.ngc", "force_xy = 900", ("force_xy = 850", "force_xy = 800", "force_xy = 750")),
)
PATIENCE_S = 120


def feedwright(*arguments):
    return subprocess.run([*COMMAND, *map(str, arguments)], capture_output=True, check=False)


def lay_out(folder):
    """A list of programs, each under several limits and a name for each. Returns the list."""
    names = []
    for name, line, limits in PROGRAMS:
        stem, ending = name.split(".")
        setup = (ROOT / "programs" / f"{stem}.setup.toml").read_text()
        assert setup.count(f"\n{line}\n") == 1, f"{stem}.setup.toml has no line {line}"
        for limit in limits:
            part = f"{stem}-{len(names)}"
            names.append(f"{part}.{ending}")
            (folder / names[-1]).write_bytes((ROOT / "programs" / name).read_bytes())
            (folder / f"{part}.setup.toml").write_text(setup.replace(line, limit))
    (folder / "list.txt").write_text("\n".join(names) + "\n")
    return folder / "list.txt"


def written(out):
    """What a batch wrote, by name: which file it is, when it was written, its bytes."""
    files = {}
    for path in sorted(out.iterdir()):
        if path.suffix != ".log" and not path.name.startswith("."):
            status = path.stat()
            files[path.name] = (status.st_ino, status.st_mtime_ns, path.read_bytes())
    return files


def said(out, part):
    """Lines of a shard's log, from all its runs."""
    path = out / f"shard-{part}-of-{SHARDS}.log"
    return path.read_text().splitlines() if path.exists() else []


def begun(out, part):
    """Names of the programs that a shard has begun, in their order; one that was begun again stands there again."""
    return [line.split()[1] for line in said(out, part) if line.startswith("runs ")]


def is_wait(line):
    return line.startswith("waits ")


def wait_for(what, until):
    end = time.monotonic() + PATIENCE_S
    while not until():
        if time.monotonic() > end:
            raise AssertionError(f"waited {PATIENCE_S} s for {what}")
        time.sleep(0.005)


@unittest.skipUnless(Client, "distributed is not installed")
class Dask(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.folder.name)
        cls.list = lay_out(folder)
        cls.alone = folder / "alone"
        cls.code = feedwright("batch", cls.list, "--out", cls.alone).returncode
        cls.merged = cls.merge(cls.alone)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def merge(cls, out):
        """Summary of all shards: exit code, what it shows, its JSON."""
        summary = out.with_suffix(".json")
        done = feedwright("merge", cls.list, "--out", out, "--json", summary)
        return done.returncode, done.stdout, summary.read_bytes()

    def with_a_worker_killed(self, out, and_its_program):
        """The list over three workers; the one with the shard LOST is killed while its second program is under way, with the process
        of `feedwright` or without. Returns the files that were there just before."""
        with (
            LocalCluster(
                n_workers=SHARDS, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
            ) as cluster,
            Client(cluster) as client,
        ):
            shards = example.submit(client, COMMAND, str(self.list), str(out), SHARDS)
            wait_for("the second program of a shard", lambda: len(begun(out, LOST)) == 2)
            worker = psutil.Process(int(said(out, LOST)[0].split()[1]))
            (program,) = worker.children()
            # Halted, so that it is under way whenever the shard begins again.
            program.suspend()
            before = written(out)
            worker.kill()
            if and_its_program:
                program.kill()
            else:
                wait_for("the shard to find its program taken", lambda: any(map(is_wait, said(out, LOST))))
                program.resume()
            codes = client.gather(shards)
        self.assertTrue(set(codes) <= {0, 1}, codes)
        self.assertEqual(max(codes), self.code)
        starts = [line for line in said(out, LOST) if line.startswith("process ")]
        self.assertEqual((len(starts), len(set(starts))), (2, 2), "the shard was not given to another process")
        return before

    def same_as_undisturbed(self, out, before):
        self.assertEqual(self.merge(out), self.merged)
        after = written(out)
        self.assertEqual(
            {name: data for name, (_, _, data) in after.items()},
            {name: data for name, (_, _, data) in written(self.alone).items()},
        )
        # What had been done when the worker was lost is the same file, written at the same time, and not one like it.
        self.assertGreaterEqual(len(before), 2)
        for name, file in before.items():
            self.assertEqual(after[name], file, f"{name} was written again")

    def test_a_lost_machine_costs_the_program_under_way(self):
        out = self.alone.with_name("machine")
        before = self.with_a_worker_killed(out, and_its_program=True)
        self.same_as_undisturbed(out, before)
        own = begun(out, LOST)
        self.assertEqual([own.count(name) for name in sorted(set(own), key=own.index)], [1, 2, 1])
        self.assertNotIn(f"{pathlib.Path(own[1]).stem}.fw{pathlib.Path(own[1]).suffix}", before)
        for part in {1, 2, 3} - {LOST}:
            self.assertEqual(len(set(begun(out, part))), len(begun(out, part)))

    def test_a_program_that_outlives_its_worker_is_not_begun_again(self):
        out = self.alone.with_name("worker")
        before = self.with_a_worker_killed(out, and_its_program=False)
        self.same_as_undisturbed(out, before)
        everything = [name for part in range(1, SHARDS + 1) for name in begun(out, part)]
        self.assertEqual(sorted(everything), sorted(set(everything)))
        self.assertEqual(len(everything), len(self.list.read_text().split()))


if __name__ == "__main__":
    unittest.main()
