#!/usr/bin/env python3
"""What the pictures of the pipelines promise: letters on the right sides, every contact seen, nothing cut off."""
import os
import sys
import unittest

import numpy as np

ROOT = os.path.join(os.path.dirname(__file__), "..", "..")
sys.path.insert(0, os.path.join(ROOT, "pipelines", "pictures"))
import boundary  # noqa: E402
import contact_sheet  # noqa: E402
import offscreen  # noqa: E402
import views  # noqa: E402

FRONT, FROM_PATIENTS_LEFT = (0, -1, 0), (1, 0, 0)


class Letters(unittest.TestCase):
    def test_of_a_patient_who_faces_us_left_is_on_the_right(self):
        right, up = views.screen_axes(FRONT)
        self.assertEqual(views.letters_of("LPS", right), "L")
        self.assertEqual(views.letters_of("LPS", -right), "R")
        self.assertEqual(views.letters_of("LPS", up), "S")
        right, up = views.screen_axes((0, 1, 0))  # the front in RAS
        self.assertEqual(views.letters_of("RAS", right), "L")

    def test_seen_from_the_left_front_is_on_the_left(self):
        right, _ = views.screen_axes(FROM_PATIENTS_LEFT)
        self.assertEqual(views.letters_of("LPS", -right), "A")

    def test_slanted_directions_have_two_letters_and_other_frames_none(self):
        self.assertEqual(views.letters_of("LPS", (0.5, 0, 0.9)), "SL")
        self.assertEqual(views.letters_of("LPS", (0.2, 0, 0.9)), "S")
        self.assertEqual(views.letters_of("none", (1, 0, 0)), "")


class Views(unittest.TestCase):
    def test_two_views_see_all_places_that_cameras_above_the_organ_can_see(self):
        rng = np.random.default_rng(7)
        for _ in range(200):
            normals = rng.normal(size=(rng.integers(1, 5), 3))
            normals[:, 2] = np.abs(normals[:, 2])
            # One place is always seen; of several most, because two cameras may not see all.
            first, second = (np.array([views.unit(n) @ views.unit(v) for n in normals]) for v in views.two_views(normals))
            seen = np.maximum(first, second) > 0.1
            self.assertTrue(seen.all() if len(normals) == 1 else seen.mean() >= 0.5, normals)
            self.assertFalse((first == second).all())

    def test_opposite_contacts_are_seen_from_opposite_sides(self):
        first, second = views.two_views(np.array([[0, -1, 0], [0, 1, 0]]))
        self.assertLess(np.array(first)[:2] @ np.array(second)[:2], -0.3)

    def test_a_shaft_points_back_along_the_way_in(self):
        path = np.array([[0, 0, 30], [0, 0, 20], [5, 0, 10]])
        np.testing.assert_allclose(views.shaft(path, 1, np.array([0, 0.6, 0.8])), [0, 0, 1])
        # A tool that began in contact, or came from inside, stands on the surface.
        np.testing.assert_allclose(views.shaft(path, 0, np.array([0, 0.6, 0.8])), [0, 0.6, 0.8])
        np.testing.assert_allclose(views.shaft(path, 1, np.array([0, 0, -1.0])), [0, 0, -1])


class Labels(unittest.TestCase):
    def test_no_label_covers_another_one_or_a_letter_or_leaves_the_picture(self):
        rng = np.random.default_rng(3)
        letters = [views.around(at, (64, 48)) for at in ((32, 430), (968, 430), (500, 24), (500, 836))]
        for _ in range(300):
            wanted = rng.uniform((0, 0), (1000, 860), size=(rng.integers(1, 7), 2))
            wanted[1:] = wanted[:1] + rng.normal(scale=15, size=wanted[1:].shape)  # all about the same place
            sizes = rng.uniform((60, 25), (150, 40), size=wanted.shape)
            boxes = [views.around(at, size) for at, size in zip(views.free_places(wanted, sizes, letters, (1000, 860)), sizes)]
            for i, box in enumerate(boxes):
                self.assertTrue(box[0] >= 0 and box[1] >= 0 and box[2] <= 1000 and box[3] <= 860)
                self.assertFalse(any(views.overlap(box, other) for other in letters + boxes[:i]))

    def test_a_label_with_room_stays_where_it_is_wanted(self):
        np.testing.assert_allclose(views.free_places([(300, 300)], [(100, 30)], [(0, 0, 50, 50)], (1000, 860)), [(300, 300)])


class Arrows(unittest.TestCase):
    def test_an_arrow_along_a_shaft_stands_beside_it_and_is_seen(self):
        rng = np.random.default_rng(5)
        for _ in range(200):
            shaft, look_from = views.unit(rng.normal(size=3)), views.unit(rng.normal(size=3))
            side = views.beside(shaft + 0.3 * rng.normal(size=3) * 0.5, shaft, look_from)
            if side.any():
                self.assertAlmostEqual(side @ look_from, 0, places=9)  # beside it on the screen, neither in front nor behind
                self.assertAlmostEqual(side @ shaft, 0, places=9)
        self.assertFalse(views.beside((1, 0, 0), (0, 0, 1), (0, -1, 0)).any())
        self.assertTrue(views.beside((0, 0, 1), (0, 0, 1), (0, -1, 0)).any())
        self.assertTrue(views.beside((0, 0, 1), (0, 0, 1), (0, 0, 1)).any())


class Rendered(unittest.TestCase):
    def test_nothing_is_cut_off_however_far_a_rod_stands_out(self):
        import offscreen
        for far in (1, 10, 100):
            actors = [offscreen.sphere((0, 0, 0), 10, (1, 0, 0)), offscreen.rod((0, 0, 0), (10 * far, 3, -5 * far), 1, (0, 0, 0))]
            image, _ = offscreen.render(actors, views.CAMERAS[0], size=(300, 200), zoom=None)
            edges = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
            self.assertTrue((edges > 250).all(), "a rod of %d mm reaches an edge of the picture" % (10 * far))
            self.assertTrue((image < 200).any(), "the picture is empty")
            shown = np.nonzero((image < 250).any(axis=2))
            self.assertGreater(max(np.ptp(shown[0]) / 200, np.ptp(shown[1]) / 300), 0.5, "what is shown is small")


class Springs(unittest.TestCase):
    def test_a_coil_joins_the_two_places_that_the_bundle_names(self):
        nodes = np.array([[0, 0, 0], [100, 0, 0], [0, 100, 0], [0, 0, 100]], float)
        attributes = {"organ": "liver", "foundation a": "normal 5 N/m^3 (test); 0.1 m^2",
                      "spring b": "30 N/m (test; from (9, 9, 9) mm); from 4 nodes at (1, 2, 3) mm to a point at (-4, 5e1, 6.5) mm",
                      "spring c": "2.5 N/m (test); from 1 nodes at (100, 0, 0) mm to their places"}
        (name, stiffness, start, end), (_, _, own, away) = boundary.springs_of(attributes, nodes)
        self.assertEqual((name, stiffness, list(start), list(end)), ("b", 30, [1, 2, 3], [-4, 50, 6.5]))
        self.assertGreater(np.linalg.norm(away - nodes.mean(axis=0)), np.linalg.norm(own - nodes.mean(axis=0)))
        low, high = np.reshape(offscreen.coil(start, end, 4, (0, 0, 1)).GetBounds(), (3, 2)).T
        self.assertTrue((low < np.minimum(start, end) + 3).all() and (high > np.maximum(start, end) - 3).all())


def table_below(text):
    """[[cell]] of the first table of a page's part."""
    rows = [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    return rows[:1] + rows[2:]


class ErrorsOfElements(unittest.TestCase):
    def setUp(self):
        with open(os.path.join(ROOT, "docs", "accuracy.md")) as page:
            self.page = page.read()

    def test_with_the_right_side_held_are_those_of_the_documentation(self):
        rows = table_below(self.page.split("\n## Mesh size and element\n")[1].split("\n### ")[0])
        column = rows[0].index("1,696")
        table = {row[0].replace("`", ""): float(row[column]) for row in rows[1:]}  # "force: p1": 7.6
        stated = {"%s: %s" % (what, element): error for element, errors in contact_sheet.ELEMENT_ERRORS["right-side"].items()
                  for what, error in zip(("force", "field"), errors)}
        self.assertEqual(stated, table)

    def test_with_the_default_boundary_set_are_those_of_the_documentation(self):
        text = self.page.split("\n### The default boundary set\n")[1].split("\n## ")[0]
        table = {row[0].split(": `")[1]: float(row[-1]) for row in table_below(text)[1:] if row[0].startswith("1,696")}
        stated = contact_sheet.ELEMENT_ERRORS["abdomen"]
        self.assertEqual({element: force for element, (force, _) in stated.items()}, table)
        self.assertEqual([element for element, (_, field) in stated.items() if field], ["p1-anp"])
        self.assertIn("The field is %.2g %% off with `p1-anp` on 1,696 vertices" % stated["p1-anp"][1], text)

    def test_are_in_the_readme_with_the_set_that_they_are_of(self):
        with open(os.path.join(ROOT, "README.md")) as page:
            readme = page.read()
        of = {boundary: errors["p1-anp"] for boundary, errors in contact_sheet.ELEMENT_ERRORS.items()}
        self.assertIn("against quadratic elements on 19,656 vertices | %.2g %% | %.2g %% |" % of["right-side"], readme)
        self.assertRegex(readme, r"supports of `abdomen`.*\| %.2g %% .*\| %.2g %% \|" % of["abdomen"])

    def test_are_stated_for_the_own_boundary_set_or_with_the_name_of_each(self):
        own, other = "the force is 9 % off, the displaced surface 22 %", "the force is 3.2 % off, the displaced surface 5.5 %"
        said = contact_sheet.stated_error({"boundary": "abdomen", "element": "p1-anp"})
        self.assertIn("boundary set abdomen " + own, said)
        self.assertNotIn("3.2", said)
        said = contact_sheet.stated_error({"boundary": "right-side", "element": "p1-anp"})
        self.assertIn("boundary set right-side " + other, said)
        self.assertNotIn("abdomen", said)
        said = contact_sheet.stated_error({"boundary": "held", "element": "p1-anp"})
        self.assertIn("boundary set right-side %s; with the boundary set abdomen %s" % (other, own), said)
        self.assertNotIn("%", contact_sheet.stated_error({"boundary": "held", "element": "p1-ang"}))
        measured = {"boundary": "held", "element": "p1-anp", "accuracy_radius_mm": 5, "accuracy_force_error": 0.02, "accuracy_field_error": 0.04}
        self.assertIn("the force 2 % off, the displaced surface 4 %", contact_sheet.stated_error(measured))


if __name__ == "__main__":
    unittest.main()
