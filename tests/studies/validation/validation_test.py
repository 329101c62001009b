#!/usr/bin/env python3
"""A short validation with the real program. Usage: validation_test.py BIN [TEST ...]"""
import csv
import glob
import json
import os
import subprocess
import sys
import tempfile
import unittest

BIN = os.path.abspath(sys.argv.pop(1))
CASES = ("patch-test", "rigid-motion", "superposition", "pressed-cylinder", "thick-sphere", "cantilever", "calculix")


def validation(*arguments, code=0):
    run = subprocess.run([os.path.join(BIN, "palpate-validation"), *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if run.returncode != code:
        raise AssertionError("palpate-validation %s ended with %d:\n%s" % (" ".join(arguments), run.returncode, run.stdout[-3000:]))
    return run.stdout


class Validation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="palpate_validation_")
        cls.folder = os.path.join(cls.scratch.name, "study")
        cls.study = ["--short", "-o", cls.folder] + [word for case in CASES for word in ("--only", case)]
        cls.said = validation(*cls.study)
        with open(os.path.join(cls.folder, "validation.json")) as file:
            cls.all = json.load(file)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def test_every_check_holds_and_every_element_was_measured(self):
        self.assertEqual(self.all["failed"], [])
        self.assertGreater(self.all["checks"], 50)
        for case in self.all["cases"]:
            elements = {s["element"] for s in case["series"]}
            self.assertEqual(elements, {"p1", "p1-anp"} | (set() if case["id"] == "superposition" else {"p2-p0"}), case["id"])
        for point in self.all["points"]:
            self.assertGreaterEqual(point["error"], 0, point)
            self.assertGreater(point["assemble_s"], 0, point)

    def test_shipped_bundles_are_held_to_f32_and_tensors_to_double(self):
        superposition = next(c for c in self.all["cases"] if c["id"] == "superposition")
        errors = {s["quantity"]: s["error"] for s in superposition["series"]}
        self.assertLess(errors["displacement, tensors in double"], 1e-12)
        self.assertLess(errors["displacement, bundle (f32) and runtime"], 1e-5)
        self.assertGreater(errors["displacement, bundle (f32) and runtime"], 1e-9)  # it did go through f32

    def test_calculix_agrees_on_at_least_ten_meshes(self):
        same = [a for a in self.all["calculix"] if a["bound"] <= 1e-6]
        self.assertGreaterEqual(len(same), 10)
        for a in same:
            self.assertLess(a["difference"], 1e-6, a["mesh"])
            self.assertGreater(a["difference"], 0, a["mesh"])  # seven digits of somebody else's
            self.assertGreater(a["calculix_s"], 0, a["mesh"])
        self.assertFalse(glob.glob("spooles.out"))

    def test_a_second_run_measures_only_what_is_missing(self):
        points = sorted(glob.glob(os.path.join(self.folder, "points", "*.json")))
        before = {f: os.stat(f).st_mtime_ns for f in points}
        os.remove(points[0])
        self.assertEqual(validation(*self.study).count("measuring"), 1)
        self.assertEqual(sorted(glob.glob(os.path.join(self.folder, "points", "*.json"))), points)
        for file in points[1:]:
            self.assertEqual(os.stat(file).st_mtime_ns, before[file])

    def test_the_report_is_one_file_with_a_line_for_each_case(self):
        with open(os.path.join(self.folder, "report.html")) as file:
            page = file.read()
        for case in self.all["cases"]:
            self.assertIn(f"<td>{case['title']}</td>", page)
        self.assertIn(f"{self.all['checks']} of {self.all['checks']} checks hold", page)
        for outside in ("<script", "<link", "src=", "@import", "url(http"):
            self.assertNotIn(outside, page)
        with open(os.path.join(self.folder, "validation.csv"), newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([(r["case"], r["quantity"]) for r in rows], [(p["case"], p["quantity"]) for p in self.all["points"]])
        pictures = glob.glob(os.path.join(self.folder, "*.png"))
        self.assertGreaterEqual(len(pictures), 5)
        for picture in pictures:
            with open(picture, "rb") as png:
                self.assertEqual(png.read(8), b"\x89PNG\r\n\x1a\n")

    def test_what_does_not_hold_ends_with_3_and_stands_in_the_report(self):
        point = next(f for f in glob.glob(os.path.join(self.folder, "points", "*.json")) if '"force, largest"' in open(f).read())
        with open(point) as file:
            whole = file.read()
        try:
            wrong = json.loads(whole)
            wrong["quantities"][0]["error"] = 1e-3
            with open(point, "w") as file:
                json.dump(wrong, file)
            self.assertIn("Rigid motion", validation(*self.study, code=3))
            with open(os.path.join(self.folder, "report.html")) as file:
                self.assertIn("1 FAILS", file.read())
        finally:
            with open(point, "w") as file:
                file.write(whole)
            validation(*self.study)

    def test_what_is_not_there_is_refused_with_a_sentence(self):
        self.assertIn("--only spleen: expected one of calculix, patch-test", validation("--only", "spleen", "-o", self.folder, code=2))
        self.assertIn("expected ORGAN/BC/RESOLUTION", validation("--organ-mesh", "liver", "--only", "calculix", "-o", self.folder, code=2))


if __name__ == "__main__":
    unittest.main(verbosity=2)
