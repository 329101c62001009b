#!/usr/bin/env python3
"""Short studies of large deformation on an ellipsoid, with the real programs. Usage: large_test.py BIN [TEST ...]"""
import math
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from study_test import StudyTest, run_program  # noqa: E402

MOVES = {"push", "pull", "drag", "oblique", "pair", "pinch"}


class LargeDeformation(StudyTest):
    result = "large-deformation.json"

    @classmethod
    def run_study(cls):
        cls.study = ["liver", "right-side", "--data", os.path.join(cls.scratch.name, "data"), "-o", cls.folder, "--resolutions", "200",
                     "--places", "2", "--radius", "20", "--depths", "10,20,30", "--poisson", "0.45,0.49", "--", "IMAGE=" + cls.ellipsoid(),
                     "SURFACE_OPTIONS_200=--labels 255 --smooth 4 --triangles 420", "TETRAHEDRA_OPTIONS_200=--region liver --size 22"]
        run_program("large_study", *cls.study)

    def points(self, **fixed):
        return [p for p in self.all["points"] if all(p[k] == v for k, v in fixed.items())]

    def test_every_move_is_solved_at_every_depth_with_both_ratios(self):
        self.assertLessEqual(MOVES - {"pinch"}, {p["move"] for p in self.all["points"]})
        for poisson in (0.45, 0.49):
            for move in MOVES - {"pinch"}:
                for depth in (10, 20, 30):
                    self.assertEqual(len(self.points(poisson=poisson, move=move, depth_mm=depth)), 2)
        self.assertEqual([p["unsolved"] for p in self.all["points"] if p["unsolved"]], [])

    def test_large_deformation_stays_near_the_converged_solution(self):
        # What the method promises at 0.1 m/s: 1 % of the field and 2 % of the force.
        for p in self.all["points"]:
            self.assertLess(p["large_field"], 0.01, p)
            self.assertLess(p["large_force"], 0.02, p)
            self.assertEqual(p["flags"] & ~64, 0, p)  # 64: a disc reaches held nodes and acts on the others

    def test_linear_elasticity_leaves_it(self):
        pushes = self.points(move="push", depth_mm=30)
        self.assertGreater(max(p["linear_force"] for p in pushes), 0.05)
        for p in pushes:  # at 10 mm it is nearer
            shallow, = self.points(move="push", depth_mm=10, place=p["place"], poisson=p["poisson"])
            self.assertLess(shallow["linear_force"], p["linear_force"])

    def test_times_are_those_of_touches_and_of_newtons_method(self):
        for mesh in self.all["meshes"]:
            linear, large, newton = mesh["touch"]["linear"], mesh["touch"]["large"], mesh["newton"]
            self.assertEqual(linear["touches"], large["touches"])
            self.assertEqual(large["touches"], 10 * 300)  # five moves at two places, 30 mm at 0.1 mm a touch
            self.assertLessEqual(large["median_us"], large["most_us"])
            self.assertGreaterEqual(newton["steps_a_tick"], 1)
            for part in ("assembly_ms", "factor_ms", "solve_ms"):
                self.assertGreater(newton[part], 0)

    def test_the_report_is_one_file_with_its_data_beside_it(self):
        page = self.page()
        for text in ("Error against depth", "Error by move", "Time of a touch", "Every state"):
            self.assertIn(text, page)
        self.assertEqual(len(self.rows("large-deformation.csv")), len(self.all["points"]))
        self.assert_pictures("field-200-nu-0.45", "force-200-nu-0.49", "every-force", "times")

    def test_a_second_run_measures_nothing_again(self):
        self.assertNotIn("measuring", run_program("large_study", *self.study))


class BetweenMeshes(StudyTest):
    result = "between-meshes.json"

    @classmethod
    def run_study(cls):
        cls.study = ["liver", "right-side", "--between-meshes", "--data", os.path.join(cls.scratch.name, "data"), "-o", cls.folder, "--resolutions",
                     "200,600", "--places", "2", "--radius", "20", "--depths", "1,10", "--poisson", "0.45", "--", "IMAGE=" + cls.ellipsoid(),
                     "SURFACE_OPTIONS_200=--labels 255 --smooth 4 --triangles 240", "TETRAHEDRA_OPTIONS_200=--region liver --size 28",
                     "SURFACE_OPTIONS_600=--labels 255 --smooth 4 --triangles 420", "TETRAHEDRA_OPTIONS_600=--region liver --size 22"]
        run_program("large_study", *cls.study)

    def force(self, mesh, element, depth, place, model):
        row, = (p for p in self.all["points"] if (p["mesh"], p["element"], p["depth_mm"], p["place"]) == (mesh, element, depth, place))
        return [row[f"{model}_{axis}_N"] for axis in "xyz"]

    def apart(self, one, other):
        return math.dist(one, other) / math.hypot(*other)

    def cases(self):
        return [(mesh, place) for mesh in ("200", "200-split", "600") for place in (0, 1)]

    def test_every_mesh_has_every_element(self):
        self.assertEqual({(m["mesh"], m["element"]) for m in self.all["meshes"]},
                         {(mesh, element) for mesh in ("200", "200-split", "600") for element in ("p1", "p1-anp", "p2-p0")})
        vertices = {m["mesh"]: m["vertices"] for m in self.all["meshes"]}
        self.assertGreater(vertices["200-split"], 4 * vertices["200"])  # a vertex for each edge

    def test_at_a_millimetre_large_is_linear(self):
        for mesh, place in self.cases():
            for element in ("p1", "p1-anp"):
                for disc in ("", "_plain"):
                    linear, large = (self.force(mesh, element, 1, place, law + disc) for law in ("linear", "large"))
                    # the strain is about 1 / 40: second order in it
                    self.assertLess(self.apart(linear, large), 0.02)
                    deep = self.apart(*(self.force(mesh, element, 10, place, law + disc) for law in ("linear", "large")))
                    self.assertGreater(deep, self.apart(linear, large))

    def test_a_finer_mesh_of_the_same_shape_is_softer(self):
        # The displacements of the coarse mesh are among those of the cut one, so that p1 can only become softer.
        for place in (0, 1):
            coarse, cut = (self.force(mesh, "p1", 1, place, "linear_plain") for mesh in ("200", "200-split"))
            self.assertLess(math.hypot(*cut), math.hypot(*coarse))

    def test_quadratic_elements_are_linear_alone(self):
        for mesh, place in self.cases():
            self.assertEqual(self.force(mesh, "p2-p0", 10, place, "large"), [None] * 3)
            self.assertLess(self.apart(self.force(mesh, "p2-p0", 10, place, "linear"), self.force(mesh, "p1-anp", 10, place, "linear")), 0.3)

    def test_the_report_is_one_file_with_its_data_beside_it(self):
        page = self.page("between-meshes.html")
        for text in ("Against the best element on the finest mesh", "Resolution or shape"):
            self.assertIn(text, page)
        self.assertEqual(len(self.rows("between-meshes.csv")), len(self.all["points"]))
        self.assert_pictures("between-meshes-nu-0.45")


if __name__ == "__main__":
    unittest.main(verbosity=2)
