"""The Python package: python_test.py BUNDLE SOURCE_FOLDER BUNDLE_WITH_MOTIONS BUNDLE_WITH_CORRIDOR BUNDLE_TO_CUT [unittest's arguments], with palpate importable."""
import ast
import gc
import inspect
import mmap
import os
import pathlib
import re
import sys
import tempfile
import threading
import time
import unittest

import numpy as np
import palpate

BUNDLE, SOURCE, MOVED, PIERCED, DIVIDED = sys.argv[1], pathlib.Path(sys.argv[2]), *sys.argv[3:6]


def mapped_bytes_of_bundle():
    """Address ranges of the bundle's file in this process."""
    lines = pathlib.Path("/proc/self/maps").read_text().splitlines()
    ranges = (line.split()[0].split("-") for line in lines if line.endswith(os.path.realpath(BUNDLE)))
    return [(int(begin, 16), int(end, 16)) for begin, end in ranges]


def address(array):
    return array.__array_interface__["data"][0]


def scene_triangle(bundle):
    """A triangle without fixed nodes that looks along z."""
    corners = bundle.nodes[bundle.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up = normals[:, 2] > 0.99 * np.linalg.norm(normals, axis=1)
    return int(np.flatnonzero(up & np.isin(bundle.triangles, bundle.touchable).all(axis=1))[0])


def pressed(scene, displacement=(0, 0, -0.002), bundle=None):
    """A touch that holds the first touchable node at a displacement."""
    node = int(scene.bundle.touchable[0])
    contacts = scene.make_contacts()
    tool = palpate.Tool(grips=[palpate.Grip(node=node, displacement=displacement)])
    flags = scene.touch([tool], 0.001, contacts)
    return node, contacts, flags


class Refusals(unittest.TestCase):
    def test_a_keyword_that_is_not_known_is_named_with_the_nearest_one(self):
        bundle = palpate.Bundle(BUNDLE)
        for make, kind, found, near in ((lambda: palpate.Scene(bundle, contcat="point"), "Scene", "contcat", "contact"),
                                        (lambda: palpate.Tool(disc_radus=0.003), "Tool", "disc_radus", "disc_radius"),
                                        (lambda: palpate.World([], fricton=0.1), "World", "fricton", "friction"),
                                        (lambda: palpate.ToolShape("ball", radios=0.01), "ToolShape", "radios", "radius")):
            with self.assertRaises(TypeError) as caught:
                make()
            self.assertEqual(str(caught.exception), "%s: expected a keyword that it has, found '%s'; did you mean '%s'?; help(palpate.%s) "
                             "lists them" % (kind, found, near, kind))
        self.assertRaisesRegex(TypeError, r"^Scene: .*law: int", palpate.Scene, bundle, law=3)
        self.assertIn("friction", palpate.Tool.__init__.__doc__)

    def test_every_method_says_in_one_line_which_keyword_it_does_not_know(self):
        said = {}
        for kind in (getattr(palpate, name) for name in palpate.__all__):
            methods = [name for name in dir(kind) if not name.startswith("_") and callable(getattr(kind, name))]
            for name in methods if isinstance(kind, type) and kind.__module__ == "palpate" and not issubclass(kind, (Exception, int)) else []:
                with self.assertRaises(TypeError, msg=name) as caught:
                    getattr(kind, name)(no_such_keyword=1)
                said["%s.%s" % (kind.__name__, name)] = str(caught.exception)
        self.assertGreater(len(said), 40)
        for method, sentence in said.items():
            self.assertEqual(sentence, "%s: expected a keyword that it has, found 'no_such_keyword'; help(palpate.%s) lists them" % (method, method))
        scene = palpate.Scene(palpate.Bundle(BUNDLE))
        contacts = scene.make_contacts()
        with self.assertRaisesRegex(TypeError, "^Scene.touch: expected a keyword that it has, found 'dtt'; did you mean 'dt'.; help.palpate.Scene.touch. lists them$"):
            scene.touch([], dtt=0.001, contacts=contacts)
        self.assertRaisesRegex(TypeError, "^Scene.touch: expected other arguments, found int, contacts: Contacts; help", scene.touch, 3, contacts=contacts)
        self.assertIn("dt: float", palpate.Scene.touch.__doc__)

    def test_numbers_that_the_scene_leaves_out_are_refused(self):
        bundle = palpate.Bundle(BUNDLE)
        scene = palpate.Scene(bundle, contact="point")
        contacts = scene.make_contacts()
        far = [[9, 9, 9]]
        for tool, sentence in ((palpate.Tool(far, disc_radius=8), "disc_radius: .*8.0"),
                               (palpate.Tool(far, disc_radius=float("nan")), "disc_radius: .*nan"),
                               (palpate.Tool(far, disc_radius=0.003), 'disc_radius: .*contact="patch"'),
                               (palpate.Tool(far, friction=0.3), 'friction: .*law="coulomb"'),
                               (palpate.Tool(far, friction=-1), "friction: .*-1.0")):
            self.assertRaisesRegex(ValueError, "^" + sentence, scene.touch, [tool], 0.001, contacts)
        self.assertEqual(scene.touch([palpate.Tool(far)], 0.001, contacts), 0)
        obeying = palpate.Scene(bundle, law="coulomb")
        self.assertEqual(obeying.touch([palpate.Tool(far, disc_radius=0.003, friction=0.3)], 0.001, obeying.make_contacts()), 0)


class Bundle(unittest.TestCase):
    def test_arrays_of_a_mapped_file_are_read_only_views_of_it(self):
        bundle = palpate.Bundle(pathlib.Path(BUNDLE))
        for array, dtype, shape in (
            (bundle.nodes, np.float64, (bundle.node_count, 3)),
            (bundle.triangles, np.int32, (bundle.triangle_count, 3)),
            (bundle.tetrahedra, np.int32, (bundle.tetrahedron_count, 4)),
            (bundle.touchable, np.int32, (bundle.touchable_count,)),
            (bundle.fixed, np.uint8, (bundle.node_count, 3)),
        ):
            self.assertEqual((array.dtype, array.shape), (np.dtype(dtype), shape))
            ranges = mapped_bytes_of_bundle()
            self.assertTrue(any(begin <= address(array) < end for begin, end in ranges), "a copy, not a view")
            with self.assertRaises(ValueError):
                array[0] = 0
            self.assertRaises(ValueError, array.setflags, write=True)

    def test_a_view_keeps_its_bundle_open_and_nothing_else_does(self):
        nodes = palpate.Bundle(BUNDLE).nodes[1:, :2]
        gc.collect()
        self.assertTrue(mapped_bytes_of_bundle())
        self.assertTrue(np.isfinite(nodes).all())
        del nodes
        gc.collect()
        self.assertEqual(mapped_bytes_of_bundle(), [])

    def test_a_file_can_be_copied_or_mapped_with_a_guard(self):
        copied = palpate.Bundle(BUNDLE, access="copy")
        self.assertEqual(address(copied.nodes), address(copied.nodes), "one copy")
        with self.assertRaises(ValueError):
            copied.nodes[0] = 0
        self.assertEqual(mapped_bytes_of_bundle(), [])
        guarded = palpate.Bundle(BUNDLE, access="map guarded")
        np.testing.assert_array_equal(copied.nodes, guarded.nodes)
        self.assertTrue(mapped_bytes_of_bundle())
        self.assertRaisesRegex(ValueError, '"map", "map guarded" or "copy"', palpate.Bundle, BUNDLE, access="read")

    def test_a_scene_keeps_its_bundle_open(self):
        scene = palpate.Scene(palpate.Bundle(BUNDLE))
        gc.collect()
        self.assertEqual(pressed(scene)[2], 0)

    def test_read_only_aligned_bytes_are_borrowed(self):
        with open(BUNDLE, "rb") as file:
            whole = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        bundle = palpate.Bundle.from_bytes(whole)
        self.assertTrue(np.shares_memory(bundle.nodes, np.frombuffer(whole, np.uint8)))
        self.assertRaises(BufferError, whole.close)
        del bundle
        gc.collect()
        whole.close()

    def test_bytes_that_may_change_are_copied(self):
        whole = bytearray(pathlib.Path(BUNDLE).read_bytes())
        bundle = palpate.Bundle.from_bytes(whole)
        nodes = palpate.Bundle(BUNDLE).nodes
        whole[:] = bytes(len(whole))
        np.testing.assert_array_equal(bundle.nodes, nodes)
        bundle.check()

    def test_errors_have_status_text_and_byte_offset(self):
        whole = pathlib.Path(BUNDLE).read_bytes()
        with self.assertRaises(palpate.Error) as absent:
            palpate.Bundle("no-such-bundle.h5")
        self.assertIs(absent.exception.status, palpate.Status.FILE)
        self.assertIn("no-such-bundle.h5", absent.exception.text)
        self.assertEqual(str(absent.exception), absent.exception.text)
        for name in (b"no-such-\xff.h5", b"\xc3" * 200):
            self.assertRaises(palpate.Error, palpate.Bundle, name)
        with self.assertRaises(palpate.Error) as cut:
            palpate.Bundle.from_bytes(whole[:-1])
        self.assertIs(cut.exception.status, palpate.Status.TRUNCATED)
        self.assertRaises(palpate.Error, palpate.Bundle.from_bytes, b"")
        # No check of the index covers the last byte; only a checksum does.
        bundle = palpate.Bundle(BUNDLE)
        at = whole.index(bundle.nodes.tobytes())
        damaged = palpate.Bundle.from_bytes(whole[: at + 7] + bytes([whole[at + 7] ^ 1]) + whole[at + 8 :])
        with self.assertRaises(palpate.Error) as checked:
            damaged.check()
        self.assertIs(checked.exception.status, palpate.Status.CHECKSUM)
        self.assertEqual(checked.exception.byte_offset, at)

    def test_provenance_is_a_dict(self):
        self.assertEqual(palpate.Bundle(BUNDLE).provenance["element"], "p1")

    def test_prefault_reads_what_scenes_have_mapped(self):
        bundle = palpate.Bundle(BUNDLE)
        palpate.Scene(bundle)
        bundle.prefault()


class Scene(unittest.TestCase):
    def setUp(self):
        self.bundle = palpate.Bundle(BUNDLE)

    def test_deform_is_for_large_deformation_beside_the_touch_alone(self):
        bundle = palpate.Bundle(BUNDLE)
        with self.assertRaisesRegex(ValueError, "large-beside"):
            palpate.Scene(bundle).deform()
        with self.assertRaisesRegex(palpate.Error, "large/order"):  # the bundle was not made for it
            palpate.Scene(bundle, deformation="large-beside")

    def test_takes_every_effect_by_its_word(self):
        words = {
            "collision": ("off", "rest", "deformed"),
            "contact": ("node", "triangle", "point", "patch"),
            "law": ("sticking", "sliding", "unilateral", "coulomb"),
            "force": ("off", "linear"),
            "shape": ("off", "surface", "volume"),
            "relaxation": (None, [(0.3, 0.1), (0.2, 1.0)]),
        }
        for effect, values in words.items():
            plans = [[repr(p) for p in palpate.Scene(self.bundle, **{effect: value}).plan] for value in values]
            self.assertTrue(all(plans), effect)
        for effect in ("radial", "force", "preload"):
            with self.assertRaises(palpate.Error) as missing:
                palpate.Scene(self.bundle, **{effect: "on" if effect == "preload" else "response"})
            self.assertIs(missing.exception.status, palpate.Status.EFFECT)
        self.assertRaisesRegex(ValueError, "collision: .*\"moved\"", palpate.Scene, self.bundle, collision="moved")
        with self.assertRaises(palpate.Error) as many:
            palpate.Scene(self.bundle, max_tools=1000)
        self.assertIs(many.exception.status, palpate.Status.ARGUMENT)
        self.assertRaises(palpate.Error, palpate.Scene, self.bundle, relaxation=[(2.0, 0.1)])

    def test_a_word_reaches_the_plan(self):
        off = [p.name for p in palpate.Scene(self.bundle, collision="off", shape="off").plan]
        on = [p.name for p in palpate.Scene(self.bundle, collision="deformed", shape="volume").plan]
        self.assertFalse([name for name in off if "collision" in name or "superposition" in name])
        self.assertIn("collision: deformed", on)
        self.assertTrue([name for name in on if "volume" in name])

    def test_limits_reach_the_step(self):
        force = {}
        for limit in (50.0, 0.01):
            scene = palpate.Scene(self.bundle, force_limit=limit, force_slew=np.inf)
            _, contacts, flags = pressed(scene)
            force[limit] = np.linalg.norm(contacts.force[0])
            self.assertEqual(bool(flags & palpate.StepFlags.FORCE_LIMITED), limit == 0.01)
        self.assertGreater(force[50.0], 0.02)
        self.assertAlmostEqual(force[0.01], 0.01, delta=1e-12)

    def test_relaxation_acts_on_held_forces(self):
        scene = palpate.Scene(self.bundle, relaxation=[(0.5, 0.05)], force_slew=np.inf)
        node, contacts, _ = pressed(scene)
        first = np.linalg.norm(contacts.force[0])
        tool = palpate.Tool(grips=[palpate.Grip(node=node, displacement=(0, 0, -0.002))])
        for _ in range(1000):
            scene.touch([tool], 0.001, contacts)
        # 1 s is 20 time constants: half is left. The first step was a ramp over 1 ms, relaxed by up to 0.5 %.
        self.assertAlmostEqual(np.linalg.norm(contacts.force[0]) / first, 0.5, delta=0.005)


class Step(unittest.TestCase):
    def setUp(self):
        self.bundle = palpate.Bundle(BUNDLE)
        self.scene = palpate.Scene(self.bundle)

    def test_the_held_node_is_where_it_is_held_and_forces_balance(self):
        node, contacts, flags = pressed(self.scene)
        self.assertIs(flags, palpate.StepFlags(0))
        self.assertEqual((contacts.step, contacts.flags), (1, 0))
        state, nodes = contacts.tools, contacts.nodes
        self.assertEqual((len(state), len(nodes), nodes["node"][0]), (1, 1, node))
        np.testing.assert_allclose(state["force_raw"][0], -nodes["force"].sum(axis=0), rtol=1e-12)
        np.testing.assert_array_equal(state["force"], contacts.force)
        displacements = np.empty((self.scene.shape_node_count, 3), np.float32)
        self.assertEqual(self.scene.shape(contacts, displacements=displacements), 0)
        # The node's own column is stored as f32.
        np.testing.assert_allclose(displacements[node], (0, 0, -0.002), atol=1e-9)

    def test_shape_writes_into_the_callers_arrays(self):
        _, contacts, _ = pressed(self.scene)
        count = self.scene.shape_node_count
        positions = np.full((count + 2, 3), 7, np.float32)
        displacements = np.empty((count, 3), np.float32)
        before = address(positions)
        self.scene.shape(contacts, positions=positions, displacements=displacements)
        self.assertEqual(address(positions), before)
        self.assertTrue((positions[count:] == 7).all())
        # One rounding to float, of numbers below 0.1 m.
        np.testing.assert_allclose(positions[:count] - displacements, self.bundle.nodes[:count], atol=2e-8)

    def test_arrays_that_do_not_fit_are_refused_and_untouched(self):
        _, contacts, _ = pressed(self.scene)
        count = self.scene.shape_node_count
        read_only = np.zeros((count, 3), np.float32)
        read_only.setflags(write=False)
        wide = np.zeros((count, 6), np.float32)
        for array, error in (
            (np.zeros((count, 3)), TypeError),
            ([[0.0] * 3] * count, TypeError),
            (np.zeros((count - 1, 3), np.float32), ValueError),
            (np.zeros(3 * count, np.float32), ValueError),
            (wide[:, ::2], ValueError),
            (np.zeros((count, 3), np.float32, order="F"), ValueError),
            (read_only, ValueError),
        ):
            for name in ("positions", "displacements"):
                self.assertRaisesRegex(error, f"^{name}: expected", self.scene.shape, contacts, **{name: array})
        self.assertFalse(read_only.any() or wide.any())

    def test_points_and_grips_are_written_in_place(self):
        tool = palpate.Tool([0.0, 0.0, 1.0], grips=[palpate.Grip(node=int(self.bundle.touchable[0]))])
        self.assertEqual(tool.points.shape, (1, 3))
        contacts = self.scene.make_contacts()
        tool.grips[0].displacement[2] = -0.001
        tool.points[0, 2] = 2.0
        self.scene.touch([tool], 0.001, contacts)
        self.assertEqual(tool.points[0, 2], 2.0)
        self.assertGreater(np.linalg.norm(contacts.force), 0)
        tool.grips[0].displacement = (0, 0, 0)
        self.scene.touch([tool], 0.001, contacts)
        self.assertLess(np.linalg.norm(contacts.tools["force_raw"]), 1e-12)

    def test_a_grip_says_what_it_holds(self):
        self.assertEqual(palpate.Grip(node=0).kind, "node")
        self.assertEqual(palpate.Grip(triangle=0).kind, "surface_point")
        for wrong in ({}, {"node": 0, "triangle": 0}):
            self.assertRaisesRegex(ValueError, "either node", palpate.Grip, **wrong)

    def test_a_tool_is_known_by_its_id(self):
        nodes = self.bundle.touchable[[0, 3]]
        tools = [
            palpate.Tool(grips=[palpate.Grip(node=int(node), displacement=(0, 0, -0.001 * (i + 1)))], id=20 + i)
            for i, node in enumerate(nodes)
        ]
        contacts = self.scene.make_contacts()
        self.scene.touch(tools, 0.001, contacts)
        force = dict(zip(contacts.tools["id"].tolist(), contacts.tools["force_raw"].tolist()))
        self.assertEqual(sorted(force), [20, 21])
        self.scene.touch(tools[::-1], 0.001, contacts)
        self.assertEqual(contacts.tools["id"].tolist(), [21, 20])
        self.assertEqual(dict(zip([21, 20], contacts.tools["force_raw"].tolist())), force)
        self.scene.reset_tool(21)
        tools[0].id = 21
        self.assertEqual(self.scene.touch(tools, 0.001, contacts), palpate.StepFlags.BAD_INPUT)

    def test_the_organ_stands_and_moves_where_its_pose_says(self):
        node = int(self.bundle.touchable[0])
        tools = [palpate.Tool(grips=[palpate.Grip(node=node, displacement=(0, 0, -0.001))])]
        contacts = self.scene.make_contacts()
        self.scene.touch(tools, 0.001, contacts)
        at_rest = contacts.tools["force_raw"][0].copy()
        half = 0.5**0.5  # a quarter turn about z, and half a metre per second
        self.scene.set_pose((1, 2, 3), (half, 0, 0, half), velocity=(0.5, 0, 0))
        for _ in range(3):
            self.scene.touch(tools, 0.001, contacts)
        np.testing.assert_allclose(contacts.organ_position, (1.001, 2, 3), atol=1e-12)
        np.testing.assert_allclose(contacts.organ_orientation, (half, 0, 0, half), atol=1e-15)
        turned = (-at_rest[1], at_rest[0], at_rest[2])
        np.testing.assert_allclose(contacts.tools["force_raw"][0], turned, atol=1e-12 * np.linalg.norm(at_rest))
        self.assertRaisesRegex(palpate.Error, "of length 1", self.scene.set_pose, orientation=(2, 0, 0, 0))
        self.assertRaisesRegex(ValueError, "orientation: expected 4 numbers", self.scene.set_pose, orientation=(1, 0, 0))
        self.scene.set_pose()
        self.scene.touch(tools, 0.001, contacts)
        np.testing.assert_array_equal(contacts.tools["force_raw"][0], at_rest)

    def test_a_saved_state_plays_on_with_the_same_bits(self):
        def play(scene, first, last):
            contacts, forces = scene.make_contacts(), []
            for s in range(first, last):
                node = int(self.bundle.touchable[s // 5 % 8])
                tool = palpate.Tool(grips=[palpate.Grip(node=node, displacement=(0, 0, -1e-4 * s))])
                scene.touch([tool], 0.001, contacts)
                forces.append(contacts.data.tobytes())
            return forces

        play(self.scene, 0, 12)
        state = self.scene.save()
        expected = play(self.scene, 12, 20)
        other = palpate.Scene(self.bundle)
        other.restore(state)
        self.assertEqual(play(other, 12, 20), expected)
        for wrong in (b"", state[:-8], state[:-1] + b"?"):
            self.assertRaises(palpate.Error, other.restore, wrong)
        with self.assertRaisesRegex(palpate.Error, "another palpate_scene_def"):
            palpate.Scene(self.bundle, max_points=3).restore(state)

    def test_warnings_of_the_library_go_to_the_logger(self):
        with self.assertLogs("palpate", "DEBUG") as logged:
            palpate.Scene(palpate.Bundle(BUNDLE), max_points=1500, max_contact_nodes=1500)
        self.assertTrue(any("max_contact_nodes (now 1500)" in line for line in logged.output), logged.output)
        self.assertTrue(all(record.levelname in ("DEBUG", "WARNING") for record in logged.records))

    def test_a_shape_becomes_points_and_has_a_torque(self):
        shape = palpate.ToolShape("sphere", radius=0.01, spacing=0.006)
        np.testing.assert_allclose(np.linalg.norm(shape.points, axis=1), 0.01, atol=1e-15)
        self.assertAlmostEqual(len(shape.points) * shape.patch_radius**2, 4 * 0.01**2, places=15)
        tool = palpate.Tool(friction=0.2)
        shape.place(tool, (1, 2, 3), (0, 1, 0, 0))
        np.testing.assert_allclose(tool.points, shape.points * (1, -1, -1) + (1, 2, 3), atol=1e-15)
        self.assertEqual((tool.disc_radius, list(tool.torque_about), tool.friction), (shape.patch_radius, [1, 2, 3], 0.2))
        self.assertRaisesRegex(palpate.Error, r"needs \d+ points", palpate.ToolShape, "sphere", radius=0.01, spacing=0.001)
        self.assertRaisesRegex(ValueError, "kind: expected one of", palpate.ToolShape, "cube", spacing=0.001)
        corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        self.assertEqual(len(palpate.ToolShape("hull", vertices=0.01 * np.array(corners), spacing=0.0125).points), 8)
        contacts = self.scene.make_contacts()
        node = int(self.bundle.touchable[0])
        held = palpate.Tool(grips=[palpate.Grip(node=node, displacement=(0, 0, -0.001))], torque_about=(0.1, 0, 0))
        self.scene.touch([held], 0.001, contacts)
        lever = self.bundle.nodes[node] + (0, 0, -0.001) - (0.1, 0, 0)
        state = contacts.tools[0]
        np.testing.assert_allclose(state["torque_raw"], np.cross(lever, state["force_raw"]), atol=1e-12)

    def test_input_that_is_no_tool_is_refused(self):
        contacts = self.scene.make_contacts()
        tool = palpate.Tool(np.zeros((2, 3)))
        tool.points.shape = (6,)
        self.assertRaisesRegex(ValueError, "points", self.scene.touch, [tool], 0.001, contacts)
        for bad in (np.zeros((2, 2)), np.zeros(4)):
            self.assertRaisesRegex(ValueError, "points: expected", palpate.Tool, bad)
        self.assertRaisesRegex(ValueError, "displacement: expected 3 numbers", palpate.Grip, node=0, displacement=(1, 2))
        for bad in (["tool"], [None]):
            self.assertRaises((TypeError, RuntimeError), self.scene.touch, bad, 0.001, contacts)
        with self.assertRaisesRegex(ValueError, "contacts"):
            self.scene.touch([], 0.001, palpate.Scene(self.bundle, max_points=3, max_contact_nodes=3).make_contacts())
        self.assertEqual(self.scene.touch([palpate.Tool([np.nan] * 3)], 0.001, contacts), palpate.StepFlags.BAD_INPUT)

    def test_contacts_with_a_field_and_amounts_travel_as_bytes(self):
        scene = palpate.Scene(palpate.Bundle(MOVED), collision="deformed", motions=True)
        contacts, other = scene.make_contacts(), scene.make_contacts()
        scene.set_motions([0.001, 0, 0, 0])
        scene.touch([], 0.001, contacts)
        other.assign(contacts.data.tobytes())
        np.testing.assert_array_equal(other.data, contacts.data)
        self.assertRaises(ValueError, other.assign, contacts.data[:-8])
        world = palpate.World([palpate.Organ(palpate.Bundle(MOVED), collision="deformed", motions=True)])
        self.assertEqual(world.touch([], 0.001, world.make_contacts()), 0)
        divided = palpate.World([palpate.Organ(palpate.Bundle(DIVIDED), collision="deformed", contact="point", cut=True)])
        self.assertEqual(divided.touch([], 0.001, divided.make_contacts()), 0)

    def test_contacts_travel_as_bytes(self):
        _, contacts, _ = pressed(self.scene)
        other = self.scene.make_contacts()
        other.assign(contacts.data.tobytes())
        shapes = [np.empty((self.scene.shape_node_count, 3), np.float32) for _ in range(2)]
        self.scene.shape(contacts, shapes[0])
        self.scene.shape(other, shapes[1])
        np.testing.assert_array_equal(*shapes)
        data = bytearray(contacts.data.tobytes())
        for cut in (b"", data[:-1], data[:100], data + bytes(64), data[:32] + b"\xff\xff\xff\x7f" + data[36:]):  # 32: node_count
            self.assertRaises(ValueError, other.assign, cut)
        np.testing.assert_array_equal(other.data, contacts.data)

    def test_mailbox_hands_over_the_newest(self):
        _, contacts, _ = pressed(self.scene)
        drawn = self.scene.make_contacts()
        mailbox = palpate.Mailbox(contacts)
        self.assertFalse(mailbox.newest(drawn))
        mailbox.publish(contacts)
        self.scene.touch([], 0.001, contacts)
        mailbox.publish(contacts)
        self.assertTrue(mailbox.newest(drawn))
        self.assertEqual(drawn.step, 2)
        self.assertFalse(mailbox.newest(drawn))
        self.assertRaises(ValueError, mailbox.publish, self.scene.make_contacts())

    def test_arrays_of_contacts_outlive_their_owner(self):
        force = pressed(self.scene)[1].force
        gc.collect()
        np.zeros(4096)
        self.assertGreater(np.linalg.norm(force), 0)
        with self.assertRaises(ValueError):
            force[0] = 0


class RenderMesh(unittest.TestCase):
    def test_strain_stress_and_carried_points_follow_a_shape(self):
        bundle = palpate.Bundle(BUNDLE)
        scene = palpate.Scene(bundle, shape="volume", inside=True, collision="off")
        self.assertEqual(scene.plan[-1].name, "inside: strain and stress")
        nodes = scene.shape_node_count
        gradient = np.array([[0.02, 0.01, 0], [0, -0.01, 0], [0, 0, 0.005]])
        u = (bundle.nodes @ gradient.T).astype(np.float32)
        x = (bundle.nodes + u).astype(np.float32)
        points = np.array([[0.02, 0.02, 0.02], [0.05, 0.01, 0.03], [1.0, 0, 0]])
        places = scene.locate(points)
        self.assertEqual(places["tetrahedron"][2], -1)
        np.testing.assert_allclose(places["weight"][:2].sum(1), 1)
        places = places[:2]
        strains, stresses = np.empty((nodes, 6), np.float32), np.empty((nodes, 6), np.float32)
        von_mises, pressures, principal = np.empty(nodes, np.float32), np.empty(nodes, np.float32), np.empty((nodes, 3), np.float32)
        self.assertEqual(scene.inside(u, strains, stresses, pressures, von_mises, principal), 0)
        np.testing.assert_allclose(strains, np.tile([0.02, -0.01, 0.005, 0.005, 0, 0], (nodes, 1)), atol=1e-6)
        np.testing.assert_allclose(pressures, -stresses[:, :3].mean(1), rtol=1e-5)
        np.testing.assert_allclose(principal.sum(1), stresses[:, :3].sum(1), rtol=1e-5)
        there, at = np.empty((2, 6), np.float32), np.empty((2, 3), np.float32)
        self.assertEqual(scene.inside_at(places, displacements=at, stresses=there), 0)
        np.testing.assert_allclose(there, stresses[:2], rtol=1e-3, atol=1e-2)  # alike everywhere
        np.testing.assert_allclose(at, points[:2] @ gradient.T, atol=1e-8)
        moved = np.empty((2, 3), np.float32)
        self.assertEqual(scene.carry(x, places, moved), 0)
        np.testing.assert_allclose(moved, points[:2] + points[:2] @ gradient.T, atol=1e-8)
        self.assertRaisesRegex(ValueError, "strains: expected shape", scene.inside, u, strains=np.empty((nodes, 3), np.float32))
        with self.assertRaisesRegex(ValueError, "inside=True"):
            palpate.Scene(bundle).locate(points)
        self.assertRaisesRegex(palpate.Error, "shape VOLUME", palpate.Scene, bundle, inside=True)

    def test_where_the_surface_passes_through_itself(self):
        bundle = palpate.Bundle(BUNDLE)
        scene = palpate.Scene(bundle, crossings=True, crossings_calls=1, crossings_operations=10**6)
        positions = np.empty((bundle.surface_node_count, 3), np.float32)
        scene.shape(scene.make_contacts(), positions)
        flags, checks, pairs, places = scene.crossings(positions)
        self.assertEqual((int(flags), checks, pairs, len(places)), (0, 1, 0, 0))
        # The box is folded over, so that its far half lies in its near half.
        middle = positions[:, 0].mean() - 0.003
        folded = positions.copy()
        folded[:, 0] = np.where(folded[:, 0] > middle, 2 * middle - folded[:, 0], folded[:, 0])
        folded[:, 2] += 0.1 * positions[:, 0]
        flags, checks, pairs, places = scene.crossings(folded)
        self.assertEqual(flags, palpate.StepFlags.SURFACE_CROSSES)
        self.assertEqual((checks, len(places)), (2, min(pairs, 64)))
        self.assertGreater(pairs, 0)
        self.assertEqual(places["rest"].shape[1:], (2, 3))
        self.assertTrue((places["triangle"][:, 0] < places["triangle"][:, 1]).all())
        self.assertEqual(palpate.Scene(bundle).crossings(positions)[0], palpate.StepFlags.BAD_INPUT)

    def test_a_render_mesh_goes_where_the_surface_does(self):
        bundle = palpate.Bundle(BUNDLE)
        rest = bundle.nodes[: bundle.surface_node_count]
        scene = palpate.Scene(bundle, render_mesh=(rest, np.tile([0.0, 0.0, 2.0], (len(rest), 1))))
        self.assertEqual(scene.vertex_count, len(rest))
        self.assertEqual(scene.plan[-1].name, "skin: render mesh")
        _, contacts, _ = pressed(scene)
        shape = np.empty((2, len(rest), 3), np.float32)
        positions, normals = np.empty_like(shape[0]), np.empty_like(shape[0])
        scene.shape(contacts, positions=shape[0], displacements=shape[1])
        self.assertEqual(scene.skin(shape[1], positions=positions, normals=normals), 0)
        self.assertGreater(np.abs(shape[1]).max(), 1e-3)
        np.testing.assert_allclose(positions, shape[0], atol=3e-8)  # floats of 6 cm
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)

    def test_a_render_mesh_sinks_to_the_discs_of_a_report(self):
        bundle = palpate.Bundle(BUNDLE)
        rest = bundle.nodes[: bundle.surface_node_count]
        scene = palpate.Scene(bundle, render_mesh=rest, report="contacts", dent="discs")
        grip = palpate.Grip(triangle=scene_triangle(bundle), barycentric=(0.4, 0.3, 0.3), displacement=(0, 0, -0.002))
        contacts = scene.make_contacts()
        scene.touch([palpate.Tool(grips=[grip], disc_radius=0.003)], 0.001, contacts)
        u = np.empty((len(rest), 3), np.float32)
        flat, dented = np.empty_like(u), np.empty_like(u)
        scene.shape(contacts, displacements=u)
        self.assertEqual(scene.skin(u, positions=flat), 0)
        planes = np.full((3, 3), 9, np.float32)
        self.assertEqual(scene.skin(u, positions=dented, report=scene.report_bytes(), disc_normals=planes), 0)
        self.assertAlmostEqual(np.linalg.norm(planes[0]), 1, delta=1e-5)
        self.assertGreater(planes[0] @ scene.report()[0][0]["disc_normal"], 0.95)
        self.assertTrue((planes[1:] == 9).all())
        contact = scene.report()[0][0]
        moved = np.linalg.norm(dented - flat, axis=1)
        self.assertGreater(moved.max(), 1e-5)
        # Within three times the wide disc, which is 1.1 node spacings here: the box is 60 mm long.
        far = np.linalg.norm(flat - contact["tool_point"], axis=1) > 0.05
        self.assertEqual(moved[far].max(initial=0), 0)
        self.assertGreater(contact["disc_radius"], 0)
        self.assertEqual(scene.skin(u, positions=dented, report=b"damaged"), palpate.StepFlags.BAD_INPUT)

    def test_what_is_no_render_mesh_is_named(self):
        bundle = palpate.Bundle(BUNDLE)
        for mesh in ([1.0, 2.0], "fine", ([[0, 0, 0]], [[0, 0, 1], [0, 0, 1]])):
            self.assertRaisesRegex(ValueError, "render_mesh", palpate.Scene, bundle, render_mesh=mesh)
        self.assertRaisesRegex(palpate.Error, "give metres", palpate.Scene, bundle, render_mesh=[[30, 20, 40]])
        scene = palpate.Scene(bundle, render_mesh=[[0.03, 0.02, 0.04]])
        u = np.zeros((bundle.surface_node_count, 3), np.float32)
        self.assertRaisesRegex(ValueError, "positions: expected shape", scene.skin, u, positions=np.empty((0, 3), np.float32))
        self.assertRaisesRegex(ValueError, "displacements: expected shape", scene.skin, u[1:])
        self.assertEqual(scene.skin(u, normals=np.empty((1, 3), np.float32)), palpate.StepFlags.BAD_INPUT)


class FineSurface(unittest.TestCase):
    def test_tools_meet_the_surface_that_they_are_given(self):
        bundle = palpate.Bundle(BUNDLE)
        mesh = bundle.nodes[: bundle.surface_node_count]
        around = mesh + 0.001 * np.sign(mesh - mesh.mean(axis=0))  # a millimetre beyond the box
        scene = palpate.Scene(bundle, fine_surface=(around, bundle.triangles), queries="on")
        self.assertIn("fine surface on the mesh", [each.name for each in scene.plan])
        above = np.array([*mesh.mean(axis=0)[:2], mesh[:, 2].max() + 0.01])
        down = [0, 0, -1]
        self.assertAlmostEqual(scene.cast_ray(above, down).distance, 0.009, delta=1e-7)
        self.assertAlmostEqual(palpate.Scene(bundle, queries="on").cast_ray(above, down).distance, 0.01, delta=1e-7)

    def test_what_is_no_fine_surface_is_named(self):
        bundle = palpate.Bundle(BUNDLE)
        mesh = bundle.nodes[: bundle.surface_node_count]
        for wrong in (mesh, (mesh,), (mesh, [1, 2]), (mesh, bundle.triangles + 0.5), "fine"):
            self.assertRaisesRegex(ValueError, "fine_surface: expected a tuple", palpate.Scene, bundle, fine_surface=wrong)
        self.assertRaisesRegex(palpate.Error, "closed surface", palpate.Scene, bundle, fine_surface=(mesh, bundle.triangles[1:]))


class Threads(unittest.TestCase):
    def setUp(self):
        self.scene = palpate.Scene(palpate.Bundle(BUNDLE))
        self.contacts = self.scene.make_contacts()
        self.positions = np.empty((self.scene.shape_node_count, 3), np.float32)

    def others_run_during(self, call):
        """Whether another thread gets the interpreter's lock during calls, when nobody is ever asked to give it up."""
        gate, ran = threading.Lock(), []
        gate.acquire()
        other = threading.Thread(target=lambda: (gate.acquire(), ran.append(True)))
        other.start()
        interval = sys.getswitchinterval()
        sys.setswitchinterval(1000)
        try:
            gate.release()
            end = time.monotonic() + 2
            while not ran and time.monotonic() < end:
                call()
            return bool(ran)
        finally:
            sys.setswitchinterval(interval)
            other.join()

    def test_touch_and_shape_release_the_interpreter(self):
        self.assertFalse(self.others_run_during(self.scene.reset))  # the measurement can also fail
        self.assertTrue(self.others_run_during(lambda: self.scene.touch([], 0.001, self.contacts)))
        self.assertTrue(self.others_run_during(lambda: self.scene.shape(self.contacts, self.positions)))

    def test_a_second_thread_in_one_half_is_refused(self):
        grips = [palpate.Grip(node=int(node), displacement=(0, 0, -1e-3)) for node in self.scene.bundle.touchable]
        refused, end = [], time.monotonic() + 20

        def touch():
            contacts, tools = self.scene.make_contacts(), [palpate.Tool(grips=grips)]
            while not refused and time.monotonic() < end:
                try:
                    self.scene.touch(tools, 0.001, contacts)
                except RuntimeError as error:
                    refused.append(str(error))

        threads = [threading.Thread(target=touch) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertIn("another thread", str(refused))


class Queries(unittest.TestCase):
    def test_rays_and_distances_see_the_surface_that_contacts_deform(self):
        bundle = palpate.Bundle(BUNDLE)
        scene = palpate.Scene(bundle, queries="on")
        low, high = bundle.nodes.min(axis=0), bundle.nodes.max(axis=0)
        place = [*((low + high) / 2)[:2] + 1e-4, high[2] + 0.01]
        hit = scene.cast_ray(place, [0, 0, -1])
        self.assertAlmostEqual(hit.distance, 0.01)
        np.testing.assert_allclose(hit.normal, [0, 0, 1])
        corners = bundle.nodes[bundle.triangles[hit.triangle]]
        np.testing.assert_allclose(hit.barycentric @ corners, hit.point, atol=1e-12)
        self.assertAlmostEqual(scene.signed_distance(place), 0.01)
        self.assertLess(scene.signed_distance((low + high) / 2), 0)
        self.assertIsNone(scene.closest_point(place, farthest=0.009))
        self.assertIsNone(scene.cast_ray(place, [0, 0, 1]))
        contacts = scene.make_contacts()
        grip = palpate.Grip(triangle=hit.triangle, barycentric=hit.barycentric, displacement=[0, 0, -0.003])
        scene.touch([palpate.Tool(grips=[grip])], 0.001, contacts)
        self.assertAlmostEqual(scene.cast_ray(place, [0, 0, -1], contacts).distance, 0.013, places=5)
        self.assertGreater(scene.closest_point(place, contacts).distance, 0.0101)
        for ask in (
            lambda: scene.cast_ray(place, [0, 0, 0]),
            lambda: scene.closest_point([np.nan, 0, 0]),
            lambda: scene.signed_distance(place, scene.make_contacts()),
        ):
            self.assertRaisesRegex(ValueError, "expected numbers that are finite", ask)
        with self.assertRaisesRegex(ValueError, 'make it with queries="on"'):
            palpate.Scene(bundle).cast_ray(place, [0, 0, -1])

    def test_report_tells_contacts_and_events(self):
        bundle = palpate.Bundle(BUNDLE)
        scene = palpate.Scene(bundle, report="contacts")
        contacts, node = scene.make_contacts(), int(bundle.touchable[5])
        tool = palpate.Tool(grips=[palpate.Grip(node=node, displacement=[0, 0, -0.001])], id=4)
        for step in range(3):
            scene.touch([tool] if step < 2 else [], 0.001, contacts)
            held, events = scene.report()
            self.assertEqual(list(events["kind"]), [[1], [], [2]][step])
            self.assertEqual(len(held), step < 2)
            if len(held):
                self.assertEqual((held["tool_id"][0], held["node"][0], held["begun"][0]), (4, node, 1))
                np.testing.assert_allclose(held["place"][0], bundle.nodes[node] + [0, 0, -0.001], atol=1e-9)
                np.testing.assert_allclose(held["force"][0], contacts.tools["force_raw"][0])
        with self.assertRaisesRegex(ValueError, 'make it with report="contacts"'):
            palpate.Scene(bundle).report()

    def test_normals_of_the_vertices(self):
        scene = palpate.Scene(palpate.Bundle(BUNDLE))
        contacts = scene.make_contacts()
        scene.touch([], 0.001, contacts)
        positions = np.zeros((scene.shape_node_count, 3), np.float32)
        normals = np.zeros_like(positions)
        scene.shape(contacts, positions)
        self.assertEqual(scene.normals(positions, normals), 0)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
        outward = ((positions - positions.mean(axis=0)) * normals).sum(axis=1)
        self.assertGreater(outward.min(), 0)


class DeviceHelp(unittest.TestCase):
    def test_steps_give_what_their_fields_show(self):
        device = palpate.Device(mass=0.1, damping=0.5)
        coupling, passivity = palpate.Coupling(device), palpate.Passivity(device)
        for k in range(10):  # the handle goes 1 mm along z; the organ pushes back with 1 N
            at = [0, 0, -1e-4 * k]
            self.assertEqual(coupling.step(at, [0, 0, 1]), palpate.DeviceFlags(0))
        self.assertGreater(coupling.tool_position[2], at[2])
        self.assertGreater(coupling.device_force[2], 0)
        for k in range(50):  # a force that pulls its own motion generates energy
            flags = passivity.step([0, 0, 1e-3 * k], [0, 0, 1], coupling.energy)
            np.testing.assert_array_equal(passivity.device_force, [0, 0, 1])
        self.assertIn(palpate.DeviceFlags.ACTIVE, flags)
        self.assertGreater(passivity.generated, 1e-3)

    def test_coupling_that_needs_more_damping_is_refused(self):
        device = palpate.Device(mass=0.1, damping=0.5, delay_ticks=0)
        self.assertAlmostEqual(palpate.Coupling.required_damping(1000, 0, 1e-3, 0), 0.5)
        self.assertEqual(palpate.Coupling(device, stiffness=999, damping=0).stiffness, 999)
        self.assertRaisesRegex(palpate.Error, "needs 0.5005", palpate.Coupling, device, stiffness=1001, damping=0)
        self.assertRaisesRegex(palpate.Error, "mass", palpate.Passivity, palpate.Device(mass=0, damping=1))
        with self.assertRaisesRegex(ValueError, "device_position: expected 3 numbers"):
            palpate.Coupling(device).step([1, 2], [0, 0, 0])

    def test_watchdog_lets_the_force_go(self):
        watchdog = palpate.Watchdog(timeout=0.01, fade=0.02)
        self.assertEqual(watchdog.step(0, [1, 0, 0], 1e-3), palpate.DeviceFlags.SILENT)
        for k in range(1, 200):
            watchdog.step(k, [1, 0, 0], 1e-3)
        np.testing.assert_array_equal(watchdog.device_force, [1, 0, 0])
        for k in range(40):
            flags = watchdog.step(199, [1, 0, 0], 1e-3)
        self.assertEqual(flags, palpate.DeviceFlags.SILENT)
        np.testing.assert_array_equal(watchdog.device_force, 0)
        self.assertAlmostEqual(watchdog.age, 0.04)


def surface_point(bundle, triangle):
    """A place in the middle of a triangle and where it is, m."""
    return (triangle, (1 / 3, 1 / 3, 1 / 3)), bundle.nodes[bundle.triangles[triangle]].mean(axis=0)


def touchable_triangles(bundle):
    touchable = np.zeros(bundle.node_count, bool)
    touchable[bundle.touchable] = True
    return np.flatnonzero(touchable[bundle.triangles].all(axis=1))


class Motions(unittest.TestCase):
    """The box of write_tiny_bundle FILE motions: the piston moves its held face, and so all of it, along x."""

    def setUp(self):
        self.bundle = palpate.Bundle(MOVED)
        self.scene = palpate.Scene(self.bundle, collision="deformed", contact="point", law="unilateral", motions=True)
        self.contacts = self.scene.make_contacts()

    def test_the_organ_moves_as_its_piston_does(self):
        self.assertEqual(self.bundle.motions, [("piston", "piston"), ("turn", "rotation"), ("filling", "pressure"), ("weight", "gravity")])
        self.scene.set_motions([0.003, 0, 0, 0])
        self.assertEqual(self.scene.touch([], 0.001, self.contacts), 0)
        moved = np.empty((self.scene.shape_node_count, 3), np.float32)
        self.scene.shape(self.contacts, displacements=moved)
        np.testing.assert_allclose(moved, np.broadcast_to([0.003, 0, 0], moved.shape), atol=1e-9)
        np.testing.assert_array_equal(self.scene.motion_states()["amount"], [0.003, 0, 0, 0])

    def test_a_volume_is_held_and_let_go(self):
        self.scene.hold_volume(2, 1e-7)
        self.scene.touch([], 0.001, self.contacts)
        state = self.scene.motion_states()[2]
        self.assertAlmostEqual(state["volume"], 1e-7, delta=1e-12)
        self.assertNotEqual(state["amount"], 0)
        self.scene.hold_volume(2, None)
        self.scene.set_motions(np.zeros(4))
        for _ in range(200):  # no faster than max_tool_speed
            self.scene.touch([], 0.001, self.contacts)
        self.assertEqual(self.scene.motion_states()[2]["amount"], 0)

    def test_refusals(self):
        self.assertRaisesRegex(palpate.Error, "found 3 amounts", self.scene.set_motions, [0, 0, 0])
        self.assertRaisesRegex(ValueError, "one number for each motion", self.scene.set_motions, [[0, 0, 0, 0]])
        self.assertRaisesRegex(palpate.Error, "a motion of kind PRESSURE", self.scene.hold_volume, 0, 1e-7)
        self.assertRaises(palpate.Error, palpate.Scene, palpate.Bundle(BUNDLE), collision="deformed", motions=True)
        self.assertEqual(palpate.Bundle(BUNDLE).motions, [])


class Loads(unittest.TestCase):
    def setUp(self):
        self.bundle = palpate.Bundle(BUNDLE)
        self.scene = palpate.Scene(self.bundle, collision="deformed", loads=[((0.06, 0.025, 0.02), 0.05)])
        self.contacts = self.scene.make_contacts()

    def test_a_weight_moves_its_patch_and_stays_downwards_as_the_organ_turns(self):
        self.scene.set_pose(orientation=(np.sqrt(0.5), 0, 0, np.sqrt(0.5)))
        self.scene.set_load(0, (0, 0, -0.001), in_world=True)
        self.assertEqual(self.scene.touch([], 0.001, self.contacts), 0)
        state = self.scene.load_states()[0]
        np.testing.assert_allclose(state["force"], (0, 0, -0.001), atol=1e-15)
        self.assertLess(state["displacement"][2], -1e-6)
        self.assertAlmostEqual(state["area"], 0.05 * 0.04, delta=1e-9)
        self.scene.set_load(0, (0.5, 0, 0), per_area=True)
        self.scene.touch([], 0.001, self.contacts)
        np.testing.assert_allclose(self.scene.load_states()[0]["force"], (0, 0.001, 0), atol=1e-9)

    def test_refusals(self):
        self.assertRaisesRegex(palpate.Error, "found load 1", self.scene.set_load, 1, (0, 0, 0))
        self.assertRaisesRegex(palpate.Error, "farther from the surface", palpate.Scene, self.bundle, collision="deformed", loads=[((1, 0, 0), 0.01)])
        self.assertRaisesRegex(ValueError, "at most 4 patches", palpate.Scene, self.bundle, loads=5 * [((0, 0, 0), 0.01)])


class ForceControl(unittest.TestCase):
    def test_a_tool_presses_with_its_force_and_tells_where_it_stands(self):
        scene = palpate.Scene(palpate.Bundle(BUNDLE), collision="deformed", law="sticking", force_control=True)
        contacts = scene.make_contacts()
        tool = palpate.Tool((0.041, 0.026, 0.0405), given_force=palpate.GivenForce((0, 0, -0.05)))
        for _ in range(60):
            scene.touch([tool], 0.001, contacts)
        state = scene.given_force_state(0)
        self.assertEqual(state["condition"], 1)
        np.testing.assert_allclose(state["force"], (0, 0, -0.05), atol=1e-6)
        np.testing.assert_allclose(contacts.tools["force_raw"][0], (0, 0, 0.05), atol=1e-6)
        self.assertLess(state["displacement"][2], -0.0005)
        tool.given_force.force[2] = -0.1
        for _ in range(60):
            scene.touch([tool], 0.001, contacts)
        self.assertAlmostEqual(scene.given_force_state(0)["force"][2], -0.1, delta=1e-6)
        tool.given_force = None
        scene.touch([tool], 0.001, contacts)
        np.testing.assert_array_equal(scene.given_force_state(0)["displacement"], 0)

    def test_a_scene_without_it_refuses_a_force(self):
        scene = palpate.Scene(palpate.Bundle(BUNDLE))
        tool = palpate.Tool((0, 0, 0), given_force=palpate.GivenForce((0, 0, 1)))
        self.assertTrue(scene.touch([tool], 0.001, scene.make_contacts()) & palpate.StepFlags.BAD_INPUT)
        self.assertIsNone(scene.given_force_state(0))
        self.assertRaisesRegex(ValueError, "force: expected 3 numbers", palpate.GivenForce, (1, 2))


class Obstacles(unittest.TestCase):
    def test_a_plate_presses_the_organ_and_feels_it(self):
        plate = palpate.Obstacle("rectangle", (0.1, 0.1), friction=0.3, position=(0.03, 0.02, 0.0405), orientation=(0, 1, 0, 0))
        far = palpate.Obstacle("mesh", mesh=(np.eye(3, dtype=np.float32), [[0, 1, 2]]), position=(5, 0, 0))
        scene = palpate.Scene(palpate.Bundle(BUNDLE), collision="deformed", obstacles=[plate, far], obstacle_nodes=100)
        contacts = scene.make_contacts()
        for step in range(30):
            scene.set_obstacle_pose(0, (0.03, 0.02, 0.0405 - 5e-5 * step), (0, 1, 0, 0))
            self.assertEqual(scene.touch([], 0.001, contacts), 0)
        states = scene.obstacle_states()
        self.assertGreater(states["force"][0][2], 0)
        self.assertGreater(states["nodes"][0], 0)
        np.testing.assert_allclose(states["position"][0], (0.03, 0.02, 0.0405 - 5e-5 * 29))
        np.testing.assert_array_equal(states["force"][1], 0)

    def test_refusals(self):
        bundle = palpate.Bundle(BUNDLE)
        self.assertRaisesRegex(ValueError, "expected one of rectangle, disc, mesh", palpate.Obstacle, "cube")
        self.assertRaisesRegex(ValueError, "mesh: expected a tuple", palpate.Obstacle, "mesh")
        disc = palpate.Obstacle("disc", 0.1)
        self.assertRaisesRegex(palpate.Error, "collision DEFORMED", palpate.Scene, bundle, collision="rest", obstacles=[disc])
        scene = palpate.Scene(bundle, collision="deformed", obstacles=[disc])
        self.assertRaisesRegex(palpate.Error, "found 1 of 1", scene.set_obstacle_pose, 1)


class Cuts(unittest.TestCase):
    """The block of cut_block.py, 80 x 50 x 40 mm, held at x = 0, all of which may be cut."""

    def setUp(self):
        self.bundle = palpate.Bundle(DIVIDED)

    def scene(self, **more):
        return palpate.Scene(self.bundle, collision="deformed", contact="point", cut=True, cut_operations=1000000000, **more)

    def cut(self, scene, begin=-0.005, end=0.055, **feels):
        """A blade along z goes through the block at x = 40 mm, along y."""
        contacts = scene.make_contacts()
        for y in np.linspace(begin, end, 60):
            scene.set_blade(0, [(0.04, y, z) for z in (-0.01, 0.01, 0.03, 0.05)], **feels)
            self.assertEqual(scene.touch([], 0.001, contacts), 0)
            self.assert_closed(scene)
        return contacts

    def assert_closed(self, scene):
        triangles, is_lip = scene.cut_surface()
        self.assertEqual((triangles.dtype, triangles.shape[1], is_lip.dtype, is_lip.shape), (np.int32, 3, np.bool_, triangles.shape[:1]))
        edges = [tuple(e) for t in triangles.tolist() for e in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))]
        self.assertEqual(len(edges), len(set(edges)))
        self.assertEqual(set(edges), {(b, a) for a, b in edges})

    def test_a_blade_cuts_a_block_in_two(self):
        scene = self.scene()
        contacts = scene.make_contacts()
        self.assertEqual(scene.touch([], 0.001, contacts), 0)
        whole, is_lip = scene.cut_surface()
        np.testing.assert_array_equal(whole, self.bundle.triangles)
        self.assertFalse(is_lip.any())
        before = scene.cut_state()
        self.assertEqual((before["faces"], before["pieces"], before["area"]), (0, 1, 0))
        self.cut(scene)
        state = scene.cut_state()
        self.assertEqual((state["pieces"], state["waiting"], state["left"], state["is_full"]), (2, 0, 0, 0))
        self.assertGreater(state["surface"], before["surface"])
        self.assertAlmostEqual(state["area"], 0.05 * 0.04, delta=2e-5)  # the plane of the cut is one of the mesh
        triangles, is_lip = scene.cut_surface()
        self.assertEqual(np.count_nonzero(is_lip), 2 * state["faces"])
        self.assertEqual(len(triangles), len(whole) + 2 * state["faces"])
        np.testing.assert_array_equal(scene.blade_state(0)["force"], 0)

    def test_lips_part_where_a_grip_pulls(self):
        scene = self.scene(shape="surface")
        contacts = self.cut(scene, end=0.035)
        scene.withdraw_blade(0)
        triangles, is_lip = scene.cut_surface()
        at_rest, shape = (np.empty((scene.shape_node_count, 3), np.float32) for _ in range(2))
        scene.shape(contacts, positions=at_rest)
        node = int(np.argmin(np.linalg.norm(self.bundle.nodes[: len(at_rest)] - (0.08, 0, 0.04), axis=1)))
        grip = palpate.Tool(grips=[palpate.Grip(node=node, displacement=(0.002, -0.001, 0))])
        self.assertEqual(scene.touch([grip], 0.001, contacts), 0)
        scene.shape(contacts, positions=shape)
        self.assertTrue(np.isfinite(shape[triangles]).all())
        np.testing.assert_allclose(shape[node] - at_rest[node], (0.002, -0.001, 0), atol=1e-6)
        # Nodes of the lips that were one node at rest.
        lips = np.unique(triangles[is_lip])
        twins = [(a, b) for a in lips for b in lips if a < b and np.linalg.norm(at_rest[a] - at_rest[b]) < 1e-6]
        self.assertTrue(twins)
        self.assertGreater(max(np.linalg.norm(shape[a] - shape[b]) for a, b in twins), 5e-4)

    def test_tissue_with_toughness_holds_the_blade(self):
        scene = self.scene()
        contacts = self.cut(scene, end=0.03, direction=(0, 1, 0), toughness=20, friction=100, width=0.01)
        state = scene.blade_state(0)
        self.assertGreater(state["friction_work"], 0)
        self.assertLess(state["force"][1], -0.1)
        self.assertGreater(state["work"], 0)
        self.assertGreater(state["in_tissue"], 0)
        scene.withdraw_blade(0)
        scene.touch([], 0.001, contacts)
        self.assertEqual(scene.blade_state(0)["in_tissue"], 0)

    def test_tissue_is_removed(self):
        scene = self.scene()
        contacts = scene.make_contacts()
        scene.remove_tissue((0.08, 0.025, 0.04), 0.015, held=0.001, needed=0.002)
        self.assertEqual(scene.touch([], 0.001, contacts), 0)
        self.assertEqual(scene.cut_state()["removed"], 0)
        scene.remove_tissue((0.08, 0.025, 0.04), 0.015, held=0.001, needed=0.002)
        self.assertEqual(scene.touch([], 0.001, contacts), 0)
        self.assertGreater(scene.cut_state()["removed"], 0)
        self.assert_closed(scene)

    def test_a_saved_cut_goes_on_with_the_same_bits(self):
        first, second = self.scene(), self.scene()
        contacts, others = self.cut(first), second.make_contacts()
        second.restore(first.save())
        for scene, into in ((first, contacts), (second, others)):
            scene.withdraw_blade(0)
            self.assertEqual(scene.touch([], 0.001, into), 0)
        np.testing.assert_array_equal(first.cut_surface()[0], second.cut_surface()[0])
        self.assertEqual(first.cut_state(), second.cut_state())
        self.assertEqual(bytes(contacts.data), bytes(others.data))

    def test_refusals(self):
        plain = palpate.Scene(palpate.Bundle(BUNDLE))
        self.assertIsNone(plain.cut_state())
        self.assertIsNone(plain.blade_state(0))
        self.assertEqual([len(of) for of in plain.cut_surface()], [0, 0])
        edge = [(0, 0, 0), (0, 0, 0.01)]
        self.assertRaisesRegex(palpate.Error, "cut ON", plain.set_blade, 0, edge)
        self.assertRaisesRegex(palpate.Error, "cut", palpate.Scene, palpate.Bundle(BUNDLE), collision="deformed", cut=True)
        self.assertRaisesRegex(palpate.Error, "DEFORMED", palpate.Scene, self.bundle, collision="rest", cut=True)
        scene = self.scene()
        self.assertRaisesRegex(palpate.Error, "PALPATE_MAX_BLADES", scene.set_blade, 4, edge)
        self.assertRaisesRegex(ValueError, "points: expected shape", scene.set_blade, 0, (0, 0, 0))
        self.assertRaisesRegex(ValueError, "points: expected shape", scene.set_blade, 0, np.zeros((17, 3)))
        self.assertRaises(palpate.Error, scene.set_blade, 0, edge, toughness=1)  # no direction
        self.assertRaises(palpate.Error, scene.remove_tissue, (0, 0, 0), 0)
        self.assertIsNone(scene.blade_state(4))


class Links(unittest.TestCase):
    def setUp(self):
        self.bundle = palpate.Bundle(BUNDLE)
        triangles = touchable_triangles(self.bundle)
        (self.first, self.a), (self.second, self.b) = (surface_point(self.bundle, int(t)) for t in (triangles[0], triangles[-1]))
        self.apart = float(np.linalg.norm(self.a - self.b))

    def scene(self):
        return palpate.Scene(self.bundle, contact="point", max_links=4)

    def played(self, links, touches=30):
        scene = self.scene()
        scene.set_links(links)
        contacts = scene.make_contacts()
        for _ in range(touches):
            scene.touch([], 0.001, contacts)
        return scene, scene.link_states(), contacts

    def test_a_thread_pulls_and_a_slack_one_does_not(self):
        _, states, contacts = self.played(
            [
                palpate.Link("thread", (self.first, self.second), rest_length=0.8 * self.apart, stiffness=30),
                palpate.Link("thread", (self.first, self.second), rest_length=2 * self.apart, id=7),
            ]
        )
        self.assertEqual(states["condition"].tolist(), [1, 0])
        self.assertEqual(states["id"].tolist(), [0, 7])
        # The law of the thread holds to the accuracy with which its line turns, 1e-4.
        self.assertAlmostEqual(states["tension"][0] / (30 * (states["length"][0] - 0.8 * self.apart)), 1, delta=1e-3)
        self.assertGreater(states["tension"][0], 0)
        self.assertEqual(states["tension"][1], 0)
        np.testing.assert_allclose(np.linalg.norm(states["force"][0]), states["tension"][0], rtol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(states["ends"][0][1] - states["ends"][0][0]), states["length"][0], rtol=1e-9)
        self.assertTrue((contacts.nodes["source"] == 2).all())

    def test_a_broken_link_says_so(self):
        link = palpate.Link("clip", (self.first, self.second), breaking_force=1)
        link.breaking_force = 1e-6
        scene = self.scene()
        scene.set_links([link])
        contacts = scene.make_contacts()
        self.assertIn(palpate.StepFlags.LINK_BROKE, scene.touch([], 0.001, contacts))
        self.assertEqual(scene.link_states()["condition"][0], 2)
        self.assertEqual(scene.link_states()["broken"][0], 1)

    def test_what_cannot_be_is_refused_in_a_sentence(self):
        self.assertRaisesRegex(ValueError, "kind: .*\"glue\"", palpate.Link, "glue", (self.first, self.second))
        self.assertRaisesRegex(ValueError, "ends: expected two, found 1", palpate.Link, "thread", (self.first,))
        self.assertRaisesRegex(TypeError, "ends: expected .triangle, weights.", palpate.Link, "thread", (self.first, 7))
        self.assertRaisesRegex(ValueError, "ends: expected 3 numbers", palpate.Link, "thread", (self.first, (3, (1, 0))))
        scene, states, _ = self.played([palpate.Link("thread", (self.first, self.second))])
        self.assertRaisesRegex(palpate.Error, "a stiffness above 0 N/m", scene.set_links, [palpate.Link("thread", (self.first, self.second), stiffness=0)])
        self.assertRaisesRegex(palpate.Error, "raise max_links", scene.set_links, [palpate.Link("thread", (self.first, self.second))] * 5)
        self.assertEqual(len(scene.link_states()), 1, "the scene keeps its links")
        self.assertRaises(RuntimeError, scene.set_links, [7])


class Grasps(unittest.TestCase):
    def setUp(self):
        self.bundle = palpate.Bundle(BUNDLE)
        triangles = touchable_triangles(self.bundle)
        far = max(triangles, key=lambda t: self.bundle.nodes[self.bundle.triangles[t]].mean(axis=0)[0])
        self.place, self.at = surface_point(self.bundle, int(far))

    def test_jaws_lift_turn_and_open(self):
        scene, grasp = palpate.Scene(self.bundle, grasps=True), palpate.Grasp(self.place, 0.01, self.at)
        contacts, tool = scene.make_contacts(), palpate.Tool(id=3, grasp=grasp, torque_about=self.at)
        scene.touch([tool], 0.001, contacts)
        self.assertLess(np.linalg.norm(contacts.tools["force_raw"][0]), 1e-9)
        grasp.position[2] += 0.002
        grasp.orientation[:] = np.cos(0.1), np.sin(0.1), 0, 0
        scene.touch([tool], 0.001, contacts)
        state = scene.grasp_state(3)
        self.assertEqual(state["condition"], 1)
        self.assertGreater(np.linalg.norm(state["force"]), 1e-3)
        self.assertGreater(np.linalg.norm(state["torque"]), 1e-6)
        np.testing.assert_allclose(state["force"], contacts.tools["force_raw"][0], rtol=1e-9)
        np.testing.assert_allclose(state["torque"], contacts.tools["torque_raw"][0], rtol=1e-9)
        tool.grasp = None
        scene.touch([tool], 0.001, contacts)
        self.assertEqual(scene.grasp_state(3)["condition"], 0)
        self.assertIsNone(scene.grasp_state(4))
        self.assertEqual(contacts.flags, 0)

    def test_beyond_its_friction_it_slips_and_lets_go(self):
        scene = palpate.Scene(self.bundle, grasps=True)
        grasp = palpate.Grasp(self.place, 0.01, self.at, friction=0.5, clamp_force=0.02)
        contacts, tool, conditions = scene.make_contacts(), palpate.Tool(grasp=grasp), []
        for _ in range(40):
            scene.touch([tool], 0.001, contacts)
            conditions.append(int(scene.grasp_state(0)["condition"]))
            grasp.position[2] += 0.0005
        self.assertEqual(sorted(set(conditions)), [1, 2, 3])
        self.assertEqual(conditions, sorted(conditions))

    def test_a_scene_without_grasps_says_that_the_input_is_bad(self):
        scene = palpate.Scene(self.bundle)
        contacts = scene.make_contacts()
        flags = scene.touch([palpate.Tool(grasp=palpate.Grasp(self.place, 0.01, self.at))], 0.001, contacts)
        self.assertIn(palpate.StepFlags.BAD_INPUT, flags)
        self.assertRaisesRegex(ValueError, "place: .*found .7,.", palpate.Grasp, (7,), 0.01, self.at)


class Needles(unittest.TestCase):
    """The box of write_tiny_bundle FILE corridor; the needle enters its far face, x = 60 mm."""

    ENTRY, INWARDS = np.array([0.06, 0.024, 0.019]), np.array([-1.0, 0, 0])
    OUTSIDE, CUTS = 1, 4

    def setUp(self):
        self.bundle = palpate.Bundle(PIERCED)

    def needle(self, **more):
        scene = palpate.Scene(self.bundle, queries="on")
        hit = scene.cast_ray(self.ENTRY - 0.01 * self.INWARDS, self.INWARDS)
        return palpate.Needle((hit.triangle, hit.barycentric), 5e-4, self.ENTRY, self.INWARDS, **more)

    def drive(self, scene, tool, contacts, begin, end):
        for depth in np.linspace(begin, end, 60):
            tool.needle.tip[:] = self.ENTRY + depth * self.INWARDS
            self.assertEqual(scene.touch([tool], 0.001, contacts), palpate.StepFlags(0))
        return scene.needle_state(3)

    def test_a_needle_cuts_is_held_by_friction_and_comes_out(self):
        scene = palpate.Scene(self.bundle, needles=True, force_limit=np.inf, force_slew=np.inf)
        tool = palpate.Tool(id=3, needle=self.needle(friction=1, cutting_force=0.02, puncture_force=0.05), torque_about=self.ENTRY)
        contacts = scene.make_contacts()
        state = self.drive(scene, tool, contacts, -0.002, 0.03)
        self.assertEqual(state["condition"], self.CUTS)
        self.assertAlmostEqual(state["tip_force"], 0.02, delta=1e-6)
        self.assertEqual(state["slipping"], state["places"])
        # 1 N/m times the way in the tissue, but for what is behind the last of its places, 5 mm apart.
        self.assertLessEqual(state["shaft_force"], state["depth"])
        self.assertGreater(state["shaft_force"], state["depth"] - 0.0055)
        np.testing.assert_allclose(state["force"], contacts.tools["force_raw"][0], rtol=1e-9)
        np.testing.assert_allclose(state["force"][0], state["tip_force"] + state["shaft_force"], rtol=1e-9)
        out = self.drive(scene, tool, contacts, 0.03, -0.01)
        self.assertEqual(out["condition"], self.OUTSIDE)
        self.assertEqual(np.linalg.norm(out["force"]), 0)
        self.assertIsNone(scene.needle_state(4))
        tool.needle.id = 1
        self.assertEqual(self.drive(scene, tool, contacts, -0.002, 0.01)["condition"], self.CUTS)

    def test_a_needle_needs_a_corridor_and_a_scene_with_needles(self):
        self.assertRaisesRegex(palpate.Error, "..corridor..", palpate.Scene, palpate.Bundle(BUNDLE), needles=True)
        self.assertRaisesRegex(palpate.Error, "needle_places", palpate.Scene, self.bundle, needles=True, needle_places=65)
        scene = palpate.Scene(self.bundle)
        flags = scene.touch([palpate.Tool(needle=self.needle())], 0.001, scene.make_contacts())
        self.assertIn(palpate.StepFlags.BAD_INPUT, flags)
        self.assertIsNone(scene.needle_state(0))


class Worlds(unittest.TestCase):
    def setUp(self):
        self.bundle = palpate.Bundle(BUNDLE)
        nodes = self.bundle.nodes[self.bundle.touchable]
        self.low, self.high = self.bundle.nodes.min(axis=0), self.bundle.nodes.max(axis=0)
        top = np.flatnonzero(nodes[:, 2] > self.high[2] - 1e-9)
        middle = (self.low + self.high) / 2
        self.place = min(top, key=lambda n: np.linalg.norm(nodes[n, :2] - middle[:2]))  # of the touchable: amid the top face
        self.node, self.top = int(self.bundle.touchable[self.place]), nodes[self.place]

    def two_face_to_face(self, **limits):
        """The second organ lies upside down on the first one, top on top."""
        organs = [palpate.Organ(self.bundle, collision="deformed", law="unilateral", report="contacts") for _ in range(2)]
        organs[1].orientation = 0, 1, 0, 0
        organs[1].position = 0, self.low[1] + self.high[1], 2 * self.high[2]
        return palpate.World(organs, **limits)

    def down_on(self, top, depth):
        """Points of a tool that comes from 2 mm above and goes `depth` deep."""
        return [np.asarray(top) + (0, 0, 0.002 - (0.002 + depth) * step / 20) for step in range(21)]

    def test_a_tool_touches_the_organ_that_it_is_near(self):
        organs = [palpate.Organ(self.bundle), palpate.Organ(self.bundle, law="unilateral")]
        organs[1].position = 0.2, 0, 0
        np.testing.assert_array_equal(organs[1].position, (0.2, 0, 0))
        world = palpate.World(organs)
        contacts = world.make_contacts()
        for point in self.down_on(self.top + (0.2, 0, 0), 0.003):
            world.touch([palpate.Tool([point], disc_radius=0.003)], 0.001, contacts)
        self.assertEqual(list(contacts.organ_states["near_tools"]), [0, 1])
        self.assertEqual(contacts.tools["organ_count"][0], 1)
        np.testing.assert_allclose(contacts.organ_states["force"][1], -contacts.tools["force_raw"][0], rtol=1e-6, atol=1e-9)
        self.assertEqual([len(of.nodes) > 0 for of in contacts.organs], [False, True])
        world.scenes[1].set_pose((0.5, 0, 0))
        self.assertFalse(len(contacts.pairs))

    def test_organs_that_touch_press_one_another(self):
        world = self.two_face_to_face(max_pairs=100, friction=0.2)
        contacts = world.make_contacts()
        world.touch([], 0.001, contacts)
        self.assertEqual(np.abs(contacts.organ_states["pressed"]).max(), 0)
        # The second organ's face is pushed 2 mm into the first one's; its own z looks down.
        grip = palpate.Grip(node=self.node, displacement=(0, 0, 0.002))
        flags = world.touch([palpate.Tool(grips=[grip], organ=1)], 0.001, contacts)
        self.assertEqual(flags, 0)
        pressed, pairs = contacts.organ_states["pressed"], contacts.pairs
        self.assertGreater(-pressed[0, 2], 0.05)
        self.assertGreater((np.linalg.norm(pairs["force"], axis=1) > 0).sum(), 0)
        self.assertTrue((np.sort(pairs["organ"], axis=1) == (0, 1)).all())
        np.testing.assert_allclose(pressed[1], -pressed[0], rtol=1e-9, atol=1e-12)
        u = np.zeros((self.bundle.surface_node_count, 3), np.float32)
        world.scenes[0].shape(contacts.organs[0], displacements=u)
        self.assertLess(u[:, 2].min(), -2e-4)
        apart = self.two_face_to_face()
        contacts = apart.make_contacts()
        apart.touch([palpate.Tool(grips=[grip], organ=1)], 0.001, contacts)
        self.assertEqual(len(contacts.organs[0].nodes), 0, "without pairs they pass through one another")

    def linked(self, links, touches=30):
        """The same two organs apart, with links of the world."""
        organs = [palpate.Organ(self.bundle, contact="point") for _ in range(2)]
        organs[1].orientation = 0, 1, 0, 0
        organs[1].position = 0, self.low[1] + self.high[1], 2 * self.high[2] + 0.01
        world = palpate.World(organs, max_links=4)
        world.set_links(links)
        contacts = world.make_contacts()
        for _ in range(touches):
            world.touch([], 0.001, contacts)
        return world, world.link_states(), contacts

    def place_on_top(self):
        places = {int(t): surface_point(self.bundle, int(t)) for t in touchable_triangles(self.bundle)}
        return max(places.values(), key=lambda place: place[1][2] - 1e-3 * np.linalg.norm(place[1] - self.top))

    def test_links_pull_organs_together(self):
        place, at = self.place_on_top()
        _, states, contacts = self.linked(
            [
                palpate.WorldLink("spring", (0, 1), (place, place), stiffness=20),
                palpate.WorldLink("thread", (0, 1), (place, place), rest_length=1, id=7),
                palpate.WorldLink("spring", (-1, 1), (at + (0, 0, 0.02), place), rest_length=0.1, stiffness=5),
            ]
        )
        self.assertEqual(states["condition"].tolist(), [1, 0, 1])
        self.assertEqual(states["id"].tolist(), [0, 7, 2])
        # The line turns to an accuracy of 1e-4, and the law of the spring holds to that.
        np.testing.assert_allclose(states["tension"][0], 20 * states["length"][0], rtol=1e-3)
        self.assertGreater(states["tension"][0], 0.01)
        self.assertEqual(states["tension"][1], 0)
        np.testing.assert_allclose(states["ends"][2][0], at + (0, 0, 0.02), atol=1e-12)
        for organ in contacts.organs:
            self.assertTrue((organ.nodes["source"] == 7).all())
        on_first = contacts.organs[0].nodes["force"].sum(axis=0)  # the first organ's frame is the world's
        np.testing.assert_allclose(on_first, states["force"][0], rtol=1e-9, atol=1e-12)

    def test_links_change_break_and_are_kept_where_others_are_refused(self):
        place, _ = self.place_on_top()
        link = palpate.WorldLink("clip", (0, 1), (place, place), stiffness=10, breaking_force=1)
        world, before, contacts = self.linked([link])
        link.stiffness, link.breaking_force = 20, 1e-6
        world.set_links([link])
        self.assertIn(palpate.StepFlags.LINK_BROKE, world.touch([], 0.001, contacts))
        broken = world.link_states()[0]
        self.assertEqual((broken["condition"], broken["broken"]), (2, 31))
        self.assertGreater(broken["tension"], 1.2 * before["tension"][0])
        self.assertRaisesRegex(palpate.Error, "organ_count", world.set_links, [palpate.WorldLink("clip", (0, 2), (place, place))])
        self.assertRaisesRegex(palpate.Error, "a stiffness above 0 N/m", world.set_links, [palpate.WorldLink("thread", (0, 1), (place, place), stiffness=0)])
        self.assertRaisesRegex(palpate.Error, "raise max_links", world.set_links, [link] * 5)
        self.assertEqual(len(world.link_states()), 1, "the world keeps its links")
        self.assertRaisesRegex(ValueError, "organs: expected two, found 1", palpate.WorldLink, "clip", (0,), (place, place))
        self.assertRaisesRegex(ValueError, "kind: .*\"glue\"", palpate.WorldLink, "glue", (0, 1), (place, place))
        self.assertRaises(RuntimeError, world.set_links, [palpate.Link("clip", (place, place))])

    def test_a_saved_state_goes_on_with_the_same_bits(self):
        world = self.two_face_to_face(max_pairs=100)
        contacts, tools, forces = world.make_contacts(), self.down_on((0.06, self.top[1], self.top[2]), 0.004), []
        for step, point in enumerate(tools + tools[10:]):
            if step == 10:
                state = world.save()
            if step == 21:
                world.restore(state)
            world.touch([palpate.Tool([point - (0.002, 0, 0)], disc_radius=0.002)], 0.001, contacts)
            forces.append(contacts.force.tobytes())
        self.assertEqual(forces[10:21], forces[21:])
        with self.assertRaisesRegex(palpate.Error, "the state has no bytes"):
            world.restore(b"")
        world.reset()
        world.touch([], 0.001, contacts)
        self.assertEqual(contacts.step, 1)

    def test_what_cannot_be_a_world_is_refused_by_a_sentence(self):
        self.assertRaisesRegex(palpate.Error, "organ", palpate.World, [])
        self.assertRaisesRegex(palpate.Error, "organ 1", palpate.World, [palpate.Organ(self.bundle), palpate.Organ(self.bundle, max_tools=3)])
        self.assertRaisesRegex(palpate.Error, "organ 0.*collision", palpate.World, [palpate.Organ(self.bundle), palpate.Organ(self.bundle)], max_pairs=10)
        with self.assertRaisesRegex(ValueError, "position: expected 3 numbers"):
            palpate.Organ(self.bundle).position = 1, 2
        self.assertRaises(TypeError, palpate.World, [self.bundle])
        world = self.two_face_to_face()
        scene, contacts = world.scenes[1], world.make_contacts()
        self.assertRaisesRegex(ValueError, "touch the world", scene.touch, [], 0.001, contacts.organs[1])
        self.assertRaises(palpate.Error, scene.save)
        self.assertRaisesRegex(ValueError, "make_contacts", world.touch, [], 0.001, palpate.World([palpate.Organ(self.bundle)]).make_contacts())

    def test_a_scene_keeps_its_world_and_a_world_its_bundles(self):
        scene = palpate.World([palpate.Organ(palpate.Bundle(BUNDLE), queries="on")]).scenes[0]
        gc.collect()
        self.assertLess(scene.signed_distance((self.low + self.high) / 2), 0)
        self.assertEqual(scene.bundle.node_count, self.bundle.node_count)


class ReadyCalls(unittest.TestCase):
    """What palpate/_calls.py adds: the frame, places by words, the plan as text, a press as a plot."""

    def test_a_word_is_the_middle_of_the_face_on_that_side_of_the_patient(self):
        bundle = palpate.Bundle(PIERCED)
        self.assertEqual(bundle.frame, "LPS")
        nodes, touchable = bundle.nodes, bundle.nodes[bundle.touchable]
        for word, axis, sign in (("foremost", 1, -1), ("hindmost", 1, 1), ("leftmost", 0, 1), ("uppermost", 2, 1)):
            place = bundle.place(word)
            self.assertEqual(place.point[axis], sign * (sign * touchable[:, axis]).max(), word)
            np.testing.assert_allclose(place.normal, sign * np.eye(3)[axis], atol=1e-12, err_msg=word)
            np.testing.assert_allclose(place.under(0.001), place.point - 0.001 * place.normal)
            self.assertTrue((nodes == place.point).all(axis=1).any(), word)
        self.assertRaisesRegex(ValueError, "did you mean 'foremost'", bundle.place, "formost")
        self.assertRaisesRegex(ValueError, "expected one of foremost.*found \\[0.1, 0, 0.1\\]", bundle.place, [0.1, 0, 0.1])

    def test_a_bundle_that_does_not_say_where_the_front_is_refuses_words(self):
        bundle = palpate.Bundle(BUNDLE)
        self.assertEqual(bundle.frame, "none")
        self.assertRaisesRegex(ValueError, "LPS or RAS.*'none'", bundle.place, "foremost")

    def test_explain_names_each_pass_of_the_plan_and_the_most_operations(self):
        scene = palpate.Scene(palpate.Bundle(BUNDLE))
        lines = scene.explain().splitlines()
        self.assertEqual(len(lines), len(scene.plan) + 2)
        for line, step in zip(lines[1:], scene.plan):
            self.assertTrue(line.startswith(step.half) and step.name in line and line.endswith(step.sections), line)
        self.assertIn(str(scene.most_operations), lines[-1])

    def test_a_press_is_drawn_and_is_the_force_that_touches_give(self):
        scene = palpate.Scene(palpate.Bundle(PIERCED))
        with tempfile.TemporaryDirectory() as folder:
            depths, forces = scene.plot_press("foremost", 0.001, os.path.join(folder, "press.png"), disc_radius=0.004, speed=0.01)
            self.assertGreater(os.path.getsize(os.path.join(folder, "press.png")), 5000)
        place, contacts = scene.bundle.place("foremost"), scene.make_contacts()
        probe = palpate.Tool(place.under(-0.002), disc_radius=0.004)
        for depth in (-0.002, 0.001):
            probe.points = place.under(depth)
            scene.touch([probe], 0.001, contacts)
        self.assertGreater(forces[-1], 0)
        self.assertAlmostEqual(forces[-1], contacts.force[0] @ place.normal, delta=1e-6 * forces[-1])  # sticking is linear in depth
        self.assertEqual((len(depths), depths[-1], forces[0]), (len(forces), 0.001, 0))
        self.assertRaisesRegex(TypeError, "did you mean 'depth'", scene.plot_press, "foremost", dept=0.001)


class Stub(unittest.TestCase):
    """palpate/__init__.pyi says what the module has."""

    def test_names_arguments_and_values_are_the_modules(self):
        stub = ast.parse((SOURCE / "bindings/python/palpate/__init__.pyi").read_text())
        fields_of = lambda node: [a.target.id for a in node.body if isinstance(a, ast.AnnAssign)]
        effects = next(fields_of(node) for node in stub.body if getattr(node, "name", "") == "_Effects")
        self.assertEqual(set(effects), set(palpate._palpate.EFFECTS))
        classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef) and not node.name.startswith("_")}
        plain = {node.target.id for node in stub.body if isinstance(node, ast.AnnAssign)}
        self.assertEqual(set(classes) | plain, set(palpate.__all__))
        for name, node in classes.items():
            real = getattr(palpate, name)
            if issubclass(real, int):
                written = {a.targets[0].id: ast.literal_eval(a.value) for a in node.body if isinstance(a, ast.Assign)}
                self.assertEqual(written, {member: int(value) for member, value in real.__members__.items()})
                continue
            functions = {f.name: f for f in node.body if isinstance(f, ast.FunctionDef)}
            if real is not palpate.Error:
                public = {member for member in vars(real) if not member.startswith("_")}
                self.assertEqual(public, {f for f in functions if f != "__init__"} | set(fields_of(node)), name)
            for function, written in functions.items():
                doc = inspect.getdoc(getattr(real, function)) or ""
                found = re.findall(r"(\w+): ", doc.split("\n")[0].split(" -> ")[0])
                asked = [a.arg for a in (*written.args.args, *written.args.kwonlyargs)]
                if not isinstance(getattr(real, function), property):
                    self.assertEqual([a for a in found if a != "self"], [a for a in asked if a != "self"], f"{name}.{function}")

    def test_everything_has_a_doc(self):
        for name in palpate.__all__:
            thing = getattr(palpate, name)
            if isinstance(thing, type):
                members = [m for m in vars(thing).items() if not m[0].startswith("_") and not isinstance(m[1], int)]
                self.assertTrue(thing.__doc__, name)
                self.assertEqual([m for m, value in members if not (value.__doc__ or "").strip()], [], name)

    def test_version_is_the_projects(self):
        version = re.search(r"project\(palpate VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text())[1]
        self.assertEqual(palpate.__version__, version)


unittest.main(argv=sys.argv[:1] + sys.argv[6:])
