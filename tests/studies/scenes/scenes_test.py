#!/usr/bin/env python3
"""A short study of scenes on an ellipsoid, with the real programs. Usage: scenes_test.py BIN [TEST ...]"""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from study_test import ROOT, StudyTest, run_program  # noqa: E402

LIVER = os.path.join(ROOT, "pipelines", "liver")


class SceneCosts(StudyTest):
    result = "scene-costs.json"

    @classmethod
    def run_study(cls):
        surface, mesh = (os.path.join(cls.scratch.name, name) for name in ("surface.ply", "mesh.msh"))
        run_program("palpate-surface", cls.ellipsoid(), "--labels", "255", "--smooth", "4", "--triangles", "420", "-o", surface)
        run_program("palpate-tetrahedra", surface, "--region", "liver", "--size", "22", "-o", mesh)
        run_program("scene_costs", mesh, "--organ", os.path.join(LIVER, "organ.toml"), "--boundary",
                    os.path.join(LIVER, "boundary", "right-side.toml"), "-o", cls.folder, "--steps", "50", "--quick")

    def axis(self, name, setting=None):
        return {p["count"]: p for p in self.all["points"] if p["axis"] == name and setting in (None, p["setting"])}

    def error(self, begin):
        found = [e for e in self.all["errors"] if e["effect"].startswith(begin)]
        self.assertTrue(found, begin)
        return found[0]

    def test_every_axis_is_timed(self):
        self.assertEqual(set(self.axis("organs", "may touch, near")), {1, 2})
        self.assertEqual(set(self.axis("modes")), {0, 1})
        self.assertEqual(set(self.axis("links", "springs")), {0, 10})
        self.assertEqual(set(self.axis("grips")), {1, 4})
        self.assertGreaterEqual(max(self.axis("pairs", "move on")), 10)
        for p in self.axis("pairs", "stand still").values():
            self.assertLess(p["unrest"], 1e-9)  # rounding: few places come to rest
        for p in self.axis("pairs", "move on, bodies beside").values():
            self.assertGreater(p["solutions_hz"], 0)
        self.assertGreaterEqual(max(self.axis("pairs", "keep their places, bodies beside")), 10)
        self.assertGreaterEqual(max(self.axis("needle")), 4)
        for p in self.all["points"]:
            self.assertGreater(p["median_us"], 0)
            self.assertLessEqual(p["median_us"], p["p90_us"])
            self.assertLessEqual(p["p90_us"], p["worst_us"])
            self.assertGreater(p["ratio"], 0)

    def test_every_effect_agrees_with_the_full_solve(self):
        # Columns are stored in single precision, 6e-8; what stiff neighbours make of it is below 1e-6 on this mesh.
        for begin in ("one tool", "1 motions and a tool", "held volume", "7 clips between", "two organs that press", "a needle that holds", "a grasp"):
            e = self.error(begin)
            self.assertGreater(e["force_N"], 1e-4, begin)
            self.assertLess(e["force_error"], 1e-6, begin)
            self.assertLess(e["field_error"], 1e-6, begin)
        self.assertLess(self.error("a grasp")["torque_error"], 1e-6)
        # A line that turned by less than 0.1 milliradian keeps its row.
        self.assertLess(self.error("a spring")["force_error"], 1e-4)

    def test_the_report_is_one_file_with_its_data_beside_it(self):
        page = self.page()
        for text in ("What a touch takes", "Each effect against a full solve"):
            self.assertIn(text, page)
        self.assertEqual(len(self.rows("scene-costs.csv")), len(self.all["points"]))
        self.assert_pictures("errors", "touch-organs", "touch-pairs", "touch-modes", "touch-links", "touch-grips", "touch-needle")


if __name__ == "__main__":
    unittest.main(verbosity=2)
