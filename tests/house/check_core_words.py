#!/usr/bin/env python3
"""No file of the runtime's core has a word of a module, in code or comments. Usage: check_core_words.py SOURCES [TEST ...]"""
import pathlib
import re
import sys
import unittest

CORE = "base bundle dense contact pose scene shape surface tissue".split()
# What a module is called, and what only it has. The frame of the world, the ways and the queries of a surface are words of the core.
WORDS = r"""
grasps: [Gg]rasp GRASP \b[Jj]aws?\b
needles: [Nn]eedle NEEDLE
links: \b[Ll]inks?\b \bLink[A-Z] \w_links?\b LINK
force control: [Ff]orce_control ForceControl [Gg]iven_force [Gg]iven\sforce
loads: palpate_loads loads_effect SurfaceLoads LoadPatch runtime/loads
motions: [Mm]otion MOTION
obstacles: [Oo]bstacle OBSTACLE
world: \w_world_ in_world\b \bWorld[A-Z] \b(of|in)\sa\sworld runtime/world organs\s(that\s)?touch pairs?\sof\s(places|organs)
relaxation: [Rr]elaxation RELAXATION [Pp]rony
large: [Ll]arge\sdeformation \b[Ll]arge[_/] \bLarge[A-Z] LARGE_ [Hh]yperelastic beside\sthe\stouch \bdeformation_
fine surface: [Ff]ine\ssurface fine_surface FineSurface
skin: \b[Ss]kin render\smesh render_mesh \b[Dd]ents?\b
cut: palpate_cut CutOrgan CutScene runtime/cut \bCUT_ \b[Bb]lades?\b [bB]lade[A-Z] BLADE \b[Ll]ips?\b
query: \b[Qq]ueries_ QueriedField runtime/query palpate_query QUERIES
report: ContactReport runtime/report
crossings: palpate_crossings CrossingCheck runtime/crossings
inside: palpate_inside InsideField \bstress
device: [Pp]assivity [Ww]atchdog
tool shape: tool_shape \bhull\b
"""
# File, what stands there, why.
EXCEPTIONS = r"""
bundle/bundle.cpp | motion_count|counts\.motions|SectionId::large_(order|stiffening) | fields of palpate_bundle_info
bundle/file_map_windows.cpp | LARGE_INTEGER | a type of Windows
"""


def table(text, separator):
    return [[part.strip() for part in line.split(separator)] for line in text.strip().splitlines()]


def words():
    for module, expressions in table(WORDS, ": "):
        yield module, re.compile("|".join(expressions.split()))


def found_in(text):
    """(line number, module, word) of each word of a module."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        for module, expression in words():
            found += [(number, module, word.group()) for word in expression.finditer(line)]
    return found


class CoreWords(unittest.TestCase):
    def test_no_word_of_a_module_stands_in_the_core(self):
        exceptions = {}
        for file, expression, reason in table(EXCEPTIONS, " | "):
            self.assertGreater(len(reason), 10, file)
            exceptions[file] = re.compile(expression)
        unused = set(exceptions)
        files = 0
        for room in CORE:
            for source in sorted((ROOT / "runtime" / room).glob("*.[hc]*")):
                file = f"{room}/{source.name}"
                text = source.read_text()
                files += 1
                if file in exceptions and found_in(text):
                    unused.discard(file)
                    text = exceptions[file].sub("", text)
                for number, module, word in found_in(text):
                    with self.subTest(file, line=number):
                        self.fail(f"runtime/{file}:{number}: \"{word}\" is a word of {module}; say what the core knows of it")
        self.assertGreater(files, 100)
        self.assertEqual(unused, set(), "no exception is needed here any more")

    def test_words_are_found(self):
        for module, line in (("grasps", "if (tool.has_grasp)"), ("needles", "// as a needle's place"), ("links", "add_link(wish)"),
                             ("motions", "MotionRows rows;"), ("loads", "palpate_loads_def def;"), ("force control", "const palpate_given_force& push"), ("world", "// of an organ of a world"), ("world", "most_world_links = 0"), ("obstacles", "if (obstacle)"), ("cut", "// where a blade is"), ("cut", "PALPATE_SOURCE_BLADE"),
                             ("large", "// under large deformation"), ("skin", "the dent of others"), ("relaxation", "def.relaxation")):
            self.assertIn(module, [found[1] for found in found_in(line)], line)
        for line in ("forces are in the world", "a query ends", "the largest move", "std::memory_order_relaxed", "two lines"):
            self.assertEqual(found_in(line), [], line)


if __name__ == "__main__":
    ROOT = pathlib.Path(sys.argv.pop(1))
    unittest.main(verbosity=2)
