#!/usr/bin/env python3
"""A short study of cuts on an ellipsoid, with the real programs. Usage: cut_test.py BIN [TEST ...]"""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from study_test import ROOT, StudyTest, run_program  # noqa: E402

LIVER = os.path.join(ROOT, "pipelines", "liver")


class CutStudy(StudyTest):
    result = "cut.json"

    @classmethod
    def run_study(cls):
        surface, mesh = (os.path.join(cls.scratch.name, name) for name in ("surface.ply", "mesh.msh"))
        run_program("palpate-surface", cls.ellipsoid(), "--labels", "255", "--smooth", "4", "--triangles", "600", "-o", surface)
        run_program("palpate-tetrahedra", surface, "--region", "liver", "--size", "18", "-o", mesh)
        run_program("cut_study", mesh, "--organ", os.path.join(LIVER, "organ.toml"), "--boundary",
                    os.path.join(LIVER, "boundary", "right-side.toml"), "-o", cls.folder, "--quick")

    def test_a_cut_is_exact_in_double_precision_and_near_in_single(self):
        for cut in ("split", "removed"):
            for stored, limit in (("f64", 1e-8), ("f32", 0.01)):
                points = [p for p in self.all["points"] if p["cut"] == cut and p["stored"] == stored]
                self.assertEqual([p["count"] for p in points][0], 1)
                self.assertGreater(points[-1]["count"], 4)
                for p in points:
                    self.assertLess(p["compliance_error"], limit, p)
                    self.assertLess(p["force_error"], limit, p)
                    self.assertGreater(p["change_us"], 0)
                    self.assertLessEqual(p["change_us"], p["worst_us"])

    def test_the_report_is_one_file_with_its_data_beside_it(self):
        self.assertIn("Exactness and cost", self.page())
        self.assertEqual(len(self.rows("cut.csv")), len(self.all["points"]))
        self.assert_pictures("error-split", "time-split", "error-removed", "time-removed")


if __name__ == "__main__":
    unittest.main(verbosity=2)
