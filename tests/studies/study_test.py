"""The setup and the checks that the tests of the studies share. Each test is called as NAME_test.py BIN [TEST ...].

A test derives from StudyTest, sets `result` to the name of the study's JSON file, and runs the study in run_study().
"""
import csv
import glob
import json
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
BIN = os.path.abspath(sys.argv.pop(1))
sys.path.insert(0, os.path.join(ROOT, "tests", "support"))
from ellipsoid_image import write_ellipsoid  # noqa: E402


def run_program(name, *arguments, code=0, folder=None):
    """Standard output and errors of a program. Fails if the exit code is not `code`."""
    run = subprocess.run([os.path.join(BIN, name), *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder)
    if run.returncode != code:
        raise AssertionError("%s %s ended with %d:\n%s" % (name, " ".join(arguments), run.returncode, run.stdout[-3000:]))
    return run.stdout


class StudyTest(unittest.TestCase):
    """Runs one study in a temporary folder: cls.folder is the study's folder, cls.all its result."""
    result = None

    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="palpate_study_")
        cls.addClassCleanup(cls.scratch.cleanup)
        cls.folder = os.path.join(cls.scratch.name, "study")
        cls.run_study()
        with open(os.path.join(cls.folder, cls.result)) as file:
            cls.all = json.load(file)

    @classmethod
    def ellipsoid(cls):
        """A small label image."""
        image = os.path.join(cls.scratch.name, "ellipsoid.nrrd")
        write_ellipsoid(image)
        return image

    def page(self, name="report.html"):
        """The report, after checking that it needs no other file."""
        with open(os.path.join(self.folder, name)) as file:
            text = file.read()
        for outside in ("<script src", "<link", 'src="http', "src=http", "@import", "url(http"):
            self.assertNotIn(outside, text)
        return text

    def rows(self, name):
        with open(os.path.join(self.folder, name), newline="") as file:
            return list(csv.DictReader(file))

    def assert_pictures(self, *patterns, least=1):
        for pattern in patterns:
            files = glob.glob(os.path.join(self.folder, pattern + ".png"))
            self.assertGreaterEqual(len(files), least, pattern)
            for name in files:
                with open(name, "rb") as png:
                    self.assertEqual(png.read(8), b"\x89PNG\r\n\x1a\n")

    def assert_measures_only_what_is_missing(self, run_again):
        """Removes one measured point and runs the study again: only this point is measured and written."""
        points = sorted(glob.glob(os.path.join(self.folder, "points", "*.json")))
        before = {f: os.stat(f).st_mtime_ns for f in points}
        os.remove(points[0])
        self.assertEqual(run_again().count("measuring"), 1)
        self.assertEqual(sorted(glob.glob(os.path.join(self.folder, "points", "*.json"))), points)
        for file in points[1:]:
            self.assertEqual(os.stat(file).st_mtime_ns, before[file])
