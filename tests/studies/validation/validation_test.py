#!/usr/bin/env python3
"""A short validation with the real program. Usage: validation_test.py BIN [TEST ...]"""
import glob
import html
import json
import os
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from study_test import ROOT, StudyTest, run_program  # noqa: E402

CASES = ("patch-test", "rigid-motion", "superposition", "pressed-cylinder", "thick-sphere", "cantilever", "cook", "calculix", "large-bar", "large-shear", "large-cook", "two-shells")


def validation(*arguments, **options):
    return run_program("palpate-validation", *arguments, **options)


class Validation(StudyTest):
    result = "validation.json"

    @classmethod
    def run_study(cls):
        cls.study = ["--short", "-o", cls.folder] + [word for case in CASES for word in ("--only", case)]
        validation(*cls.study)

    def test_every_check_holds_and_every_element_was_measured(self):
        self.assertEqual(self.all["failed"], [])
        self.assertGreater(self.all["checks"], 50)
        for case in self.all["cases"]:
            elements = {s["element"] for s in case["series"]}
            if case["id"] == "two-shells":
                self.assertEqual(elements, {"p1-anp", "p1-ang"})
                continue
            linear_alone = case["id"] == "superposition" or case["id"].startswith("large-")
            self.assertEqual(elements, {"p1", "p1-anp"} | (set() if linear_alone else {"p2-p0"}), case["id"])
        for point in self.all["points"]:
            self.assertGreaterEqual(point["error"], 0, point)
            if point["case"] != "two-shells":  # palpate-precompute assembles them
                self.assertGreater(point["assemble_s"], 0, point)

    def test_tensors_are_exact_to_double_and_bundles_to_f32(self):
        superposition = next(c for c in self.all["cases"] if c["id"] == "superposition")
        errors = {s["quantity"]: s["error"] for s in superposition["series"]}
        self.assertLess(errors["displacement, tensors in double"], 1e-12)
        self.assertLess(errors["displacement, bundle (f32) and runtime"], 1e-5)
        self.assertGreater(errors["displacement, bundle (f32) and runtime"], 1e-9)  # the bundle stores f32

    def test_calculix_agrees_on_at_least_ten_meshes(self):
        same = [a for a in self.all["calculix"] if a["bound"] <= 1e-6]
        self.assertGreaterEqual(len(same), 10)
        for a in same:
            self.assertLess(a["difference"], 1e-6, a["mesh"])
            self.assertGreater(a["difference"], 0, a["mesh"])  # another program's result, printed with seven digits
            self.assertGreater(a["calculix_s"], 0, a["mesh"])
        self.assertFalse(glob.glob("spooles.out"))

    def test_calculix_agrees_with_large_strain_at_every_depth(self):
        pushed = [a for a in self.all["calculix"] if "large strain" in a["mesh"]]
        self.assertEqual(len(pushed), 5)
        for a in pushed:
            self.assertLess(a["difference"], 1e-6, a["mesh"])
            self.assertGreater(a["difference"], 0, a["mesh"])

    def test_calculix_agrees_about_the_contact_of_two_blocks(self):
        pressed = [a for a in self.all["calculix"] if "two blocks in contact" in a["mesh"]]
        self.assertEqual(len(pressed), 1)
        for a in pressed:
            self.assertLess(a["difference"], 0.03, a["mesh"])
            self.assertGreater(a["difference"], 1e-6, a["mesh"])  # springs there, reactions here: not the same equations

    def test_two_shells_under_a_plate_are_as_stiff_as_in_four_published_codes(self):
        """A coarse mesh: the bounds of the finest one are those of the study."""
        forces = {p["quantity"]: p["value"] for p in self.all["points"] if p["case"] == "two-shells" and p["element"] == "p1-ang" and p["cells"] == 12}
        for form, depth, least, most in (("large", 2, 0.66, 0.80), ("large", 3, 1.07, 1.27), ("large", 4, 1.64, 1.82), ("large", 5, 0.98 * 2.24, 2.44),
                                         ("large beside", 5, 0.98 * 2.24, 2.44)):
            force = forces[f"{form}: force at {depth} mm, N"]
            self.assertGreater(force, least, (form, depth))
            self.assertLess(force, most, (form, depth))
        self.assertGreater(forces["linear: force at 5 mm, N"], 2 * 2.44)  # what the bodies are large for

    def test_a_second_run_measures_only_what_is_missing(self):
        self.assert_measures_only_what_is_missing(lambda: validation(*self.study))

    def test_the_report_is_one_file_with_a_line_for_each_case(self):
        page = self.page()
        for case in self.all["cases"]:
            self.assertIn(f"<td>{html.escape(case['title'])}</td>", page)
        self.assertIn(f"{self.all['checks']} of {self.all['checks']} checks hold", page)
        self.assertEqual([(r["case"], r["quantity"]) for r in self.rows("validation.csv")],
                         [(p["case"], p["quantity"]) for p in self.all["points"]])
        self.assert_pictures("*", least=5)

    def test_a_failed_check_ends_with_3_and_is_in_the_report(self):
        point = next(f for f in glob.glob(os.path.join(self.folder, "points", "*.json")) if '"force, largest"' in open(f).read())
        with open(point) as file:
            whole = file.read()
        try:
            wrong = json.loads(whole)
            wrong["quantities"][0]["error"] = 1e-3
            with open(point, "w") as file:
                json.dump(wrong, file)
            self.assertIn("Rigid motion", validation(*self.study, code=3))
            self.assertIn("1 FAILS", self.page())
        finally:
            with open(point, "w") as file:
                file.write(whole)
            validation(*self.study)

    def test_the_table_of_published_numbers_is_that_of_the_documentation(self):
        """The figures of a short run are those of coarse meshes: compared are case, quantity, source and published number."""
        page = os.path.join(self.scratch.name, "accuracy.md")
        shutil.copy(os.path.join(ROOT, "docs", "accuracy.md"), page)

        def rows():
            with open(page) as file:
                lines = file.read().partition("<!-- published numbers")[2].partition("<!-- end of the published numbers")[0].splitlines()
            table = [line.split(" | ") for line in lines if line.startswith("| `")]
            return {tuple(row[:2]): row[2:] for row in table}
        documented = rows()
        subprocess.run([sys.executable, os.path.join(ROOT, "studies", "validation", "published.py"), os.path.join(self.folder, "validation.json"), page],
                       check=True)
        written = rows()
        self.assertEqual({case for case, _ in written}, {f"| `{case}`" for case in ("pressed-cylinder", "thick-sphere", "cantilever", "cook", "large-cook", "two-shells")})
        for what, row in written.items():
            self.assertEqual(row[:2], documented[what][:2])
            if "two-shells" not in what[0]:  # its meshes are the same in a short run
                self.assertNotEqual(row[2:], documented[what][2:])  # another mesh, another figure

    def test_an_unknown_case_or_mesh_is_refused_with_a_sentence(self):
        self.assertIn("--only spleen: ", validation("--only", "spleen", "-o", self.folder, code=2))
        self.assertIn("ORGAN/BC/RESOLUTION", validation("--organ-mesh", "liver", "--only", "calculix", "-o", self.folder, code=2))


if __name__ == "__main__":
    unittest.main(verbosity=2)
