"""The program for Windows, cross-built, under Wine against the one for this system: the same bytes, and what a person meets first.

    FEEDWRIGHT=…/feedwright FEEDWRIGHT_EXE=…/feedwright.exe python3 -m unittest discover -s tests/windows

Needs wine64 and, for one library that Wine 8 lacks, the C compiler of mingw-w64."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
PROGRAMS = HERE.parents[1] / "programs"
# Debian has wine64 out of the way of those who use `wine`.
WINE = shutil.which("wine64") or shutil.which("wine") or "/usr/lib/wine/wine64"
COMPILER = "x86_64-w64-mingw32-gcc"
# Two tools, as posts write them; neither the material nor the stock is told.
PART = (
    "%\nO1000 (PART)\n(T1 D=10. CR=0. - ZMIN=-4. - FLAT END MILL)\n(T2 D=5. CR=0. TAPER=118DEG - ZMIN=-12. - DRILL)\n"
    "G90 G94 G17\nG21\nT1 M6\nS8000 M3\nG54\nG0 X-10 Y5 Z5\nG1 Z-4 F300\nX110 F800\nG0 Z5\nT2 M6\nS3000 M3\n"
    "G0 X20 Y20 Z5\nG98 G81 X20 Y20 Z-12 R2 F200\nX40\nG80\nG0 Z50\nM30\n%\n"
)
TOLD = ("--material", "7075", "--stock", "X0 Y0 Z-20 X100 Y60 Z0", "--tool", "T1 3 flutes")


class Windows(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        cls.folder = pathlib.Path(cls.place.name)
        cls.exe = cls.folder / "bin" / "feedwright.exe"
        cls.exe.parent.mkdir()
        shutil.copy(os.environ["FEEDWRIGHT_EXE"], cls.exe)
        library = [HERE / "bcryptprimitives.c", "-o", cls.exe.with_name("bcryptprimitives.dll"), "-ladvapi32"]
        subprocess.run([COMPILER, "-shared", *library], check=True)
        # Neither .NET nor a browser engine is asked for, and nothing is drawn.
        own = {"WINEPREFIX": str(cls.folder / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree=;mshtml="}
        cls.environment = {**os.environ, **own}
        # Wine's own processes stay until the end, and speak to nobody: what a run says is what the program says.
        (cls.folder / "wine").mkdir()
        cls.serve("-p")
        nowhere = {name: subprocess.DEVNULL for name in ("stdin", "stdout", "stderr")}
        subprocess.run([WINE, "wineboot", "-i"], env=cls.environment, check=True, **nowhere)

    @classmethod
    def tearDownClass(cls):
        # The server of this prefix and no other.
        cls.serve("-k")
        cls.place.cleanup()

    @classmethod
    def serve(cls, option):
        server = shutil.which("wineserver") or pathlib.Path(WINE).with_name("wineserver")
        subprocess.run([server, option], env=cls.environment, check=False)

    def here(self, folder, *arguments):
        return self.run_in(folder, [os.environ["FEEDWRIGHT"], *arguments])

    def there(self, folder, *arguments):
        return self.run_in(folder, [WINE, str(self.exe), *arguments])

    def run_in(self, folder, command):
        """Exit code, standard output, standard error; without a terminal."""
        done = subprocess.run(
            command, cwd=folder, env=self.environment, stdin=subprocess.DEVNULL, capture_output=True, check=False
        )
        return done.returncode, done.stdout, done.stderr

    def pair(self, name, files):
        """Two folders with the same files, one for each system."""
        folders = []
        for system in ("linux", "windows"):
            folder = self.folder / name / system
            folder.mkdir(parents=True)
            for file, data in files.items():
                (folder / file).write_bytes(data)
            folders.append(folder)
        return folders

    def test_the_same_bytes_as_on_this_system(self):
        for program, setup in (("pocket.nc", "pocket.setup.toml"), ("bracket.nc", "bracket.setup.toml")):
            files = {name: (PROGRAMS / name).read_bytes() for name in (program, setup)}
            linux, windows = self.pair(program, files)
            known = self.here(linux, "optimize", program)
            self.assertEqual(self.there(windows, "optimize", program), known)
            self.assertEqual(known[0], 0, known)
            name = program.replace(".nc", ".fw.nc")
            written = (linux / name).read_bytes()
            self.assertNotEqual(written, files[program])
            self.assertEqual((windows / name).read_bytes(), written, name)
            # Once more: its own file is known as that, and replaced.
            self.assertEqual(self.there(windows, "optimize", program), known)
            code, shown, _ = self.there(windows, "verify", program, name)
            self.assertEqual(code, 0, shown)
            code, shown, _ = self.there(windows, "verify", setup, name)
            self.assertNotEqual(code, 0, shown)

    def test_a_program_dropped_on_it(self):
        linux, windows = self.pair("my parts", {"part.nc": PART.encode()})
        # As Explorer gives it: one argument, the whole path, from another folder.
        dropped = "Z:" + str(windows / "part.nc").replace("/", "\\")
        code, _, said = self.there(self.folder, dropped)
        self.assertEqual(code, 2, said)
        for word in (b"material of the stock", b"box of the stock", b"flutes of T1", b"--material", b"init"):
            self.assertIn(word, said)
        self.assertIn(f'feedwright "{dropped}" --material'.encode(), said)
        self.assertEqual([path.name for path in windows.iterdir()], ["part.nc"])
        code, _, said = self.there(self.folder, "init", dropped)
        self.assertEqual((code, self.here(linux, "init", "part.nc")[0]), (1, 1), said)
        drafts = [folder / "part.setup.toml" for folder in (linux, windows)]
        self.assertEqual(drafts[1].read_bytes(), drafts[0].read_bytes())
        for draft in drafts:
            draft.unlink()
        # With what was lacking: setup, program and page.
        code, shown, said = self.there(self.folder, dropped, *TOLD)
        self.assertEqual((code, self.here(linux, "part.nc", *TOLD)[0]), (0, 0), said)
        self.assertIn(b"every limit is met", shown)
        for name in ("part.setup.toml", "part.fw.nc"):
            self.assertEqual((windows / name).read_bytes(), (linux / name).read_bytes(), name)
        page = (windows / "part.fw.html").read_bytes()
        self.assertTrue(page.startswith(b"<!DOCTYPE html>") and page.rstrip().endswith(b"</html>"))
        self.assertEqual(len(list(windows.iterdir())), 4, "something was left behind")
        # The setup is there now: the path alone does.
        self.assertEqual(self.there(self.folder, dropped)[0], 0)

    def test_two_batches_at_once_do_every_program_once(self):
        files = {name: (PROGRAMS / name).read_bytes() for name in ("pocket.nc", "pocket.setup.toml")}
        files["again.nc"], files["again.setup.toml"] = files["pocket.nc"], files["pocket.setup.toml"]
        linux, windows = self.pair("batch", files)
        both = [
            subprocess.Popen(
                [WINE, str(self.exe), "batch", ".", "--out", "out"],
                cwd=windows,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
            )
            for _ in range(2)
        ]
        shown, said = zip(*(one.communicate() for one in both))
        self.assertEqual([one.returncode for one in both], [0, 0], said)
        runs = sorted(line for text in said for line in text.splitlines() if line.startswith(b"runs "))
        self.assertEqual([line.split()[1] for line in runs], [b"again.nc", b"pocket.nc"])
        alone = self.here(linux, "batch", ".", "--out", "out")
        self.assertEqual((shown[0], shown[1]), (alone[1], alone[1]))
        names = ["again.fw.nc", "again.fw.nc.json", "pocket.fw.nc", "pocket.fw.nc.json"]
        self.assertEqual(sorted(path.name for path in (windows / "out").iterdir()), names)
        for name in ("again.fw.nc", "pocket.fw.nc"):
            self.assertEqual((windows / "out" / name).read_bytes(), (linux / "out" / name).read_bytes())


if __name__ == "__main__":
    unittest.main()
