#!/usr/bin/env python3
"""Compares every #include of our sources with what each folder may depend on. Usage: check_includes.py SOURCES [TEST ...]"""
import pathlib
import re
import sys
import unittest

# By the beginning of a header's name; CLI11 and toml++ take seconds to compile: mains include the one, two sources the other.
LIBRARIES = """
system: assert.h dlfcn.h errno.h fcntl.h float.h glob.h limits.h math.h netdb.h netinet/ poll.h pthread.h sched.h setjmp.h signal.h
system: std malloc.h string.h sys/ termios.h time.h unistd.h windows.h immintrin.h
HDF5: hdf5 H5
MPI: mpi.h
PETSc: petsc
SuiteSparse: suitesparse/
Eigen: Eigen/
CGAL: CGAL/ boost/
gmsh: gmsh
ITK: itk
VTK: vtk
zlib: zlib.h
pybind11: pybind11/
OpenIGTLink: igtl
CLI11: CLI/
toml++: toml++/
plumbing: fmt/ spdlog/ nlohmann/ openssl/
palpate: palpate/
"""
LAYOUT = ("formats/bundle_layout.h formats/bundle_reader.h formats/bundle_sections.def formats/checksum.h formats/half.h "
          "formats/compliance_blocks.h formats/response_check.h formats/tissue_laws.h formats/averaged_shear.h "
          "formats/element_layout.h")
# Where (the longest beginning that fits decides): which of our headers: which libraries. Data flows one way; the runtime needs a compiler
# and the bundle layout alone; studies use nothing of bench/, tests/ and programs/, but for the one that plays scenes.
RULES = """
formats/: formats/: plumbing
formats/scene_: formats/: plumbing palpate
formats/bundle_writer.cpp: formats/: plumbing HDF5
formats/command_line.cpp: formats/: plumbing CLI11
formats/toml_reader.cpp: formats/: plumbing toml++
formats/bundle_layout.h: LAYOUT:
formats/bundle_reader.: LAYOUT:
formats/bundle_sections.def: LAYOUT:
formats/checksum.: LAYOUT:
formats/half.h: LAYOUT:
formats/compliance_blocks.h: LAYOUT:
formats/response_check.: LAYOUT:
formats/tissue_laws.h: LAYOUT:
formats/averaged_shear.h: LAYOUT:
formats/element_layout.h: LAYOUT:
meshing/image/: meshing/image/ formats/: plumbing zlib
meshing/image/thickness.cpp: meshing/image/: ITK
meshing/surface/: meshing/surface/ meshing/image/ formats/: plumbing Eigen CGAL
meshing/cut/: meshing/cut/ meshing/tetrahedra/mesh_quality.h runtime/cut/ runtime/surface/ runtime/base/ formats/: plumbing
meshing/tetrahedra/: meshing/tetrahedra/ meshing/surface/ meshing/image/ formats/: plumbing Eigen CGAL gmsh
precompute/elements/: precompute/elements/ meshing/image/ formats/: plumbing Eigen
precompute/solver/: precompute/solver/ precompute/elements/ formats/: plumbing PETSc MPI SuiteSparse Eigen
precompute/ranks/: precompute/ranks/ precompute/solver/ precompute/elements/ formats/: plumbing PETSc MPI
precompute/tensors/: precompute/tensors/ precompute/solver/ precompute/elements/ formats/: plumbing Eigen
precompute/journal/: precompute/journal/ precompute/tensors/ precompute/elements/ formats/: plumbing
precompute/run/: precompute/ formats/: plumbing MPI Eigen
precompute/bundle_tool/: precompute/bundle_tool/ precompute/tensors/ precompute/solver/ precompute/elements/ formats/: plumbing PETSc Eigen
runtime/base/: LAYOUT runtime/include/ runtime/base/:
runtime/dense/: LAYOUT runtime/include/ runtime/dense/ runtime/base/:
runtime/bundle/: LAYOUT runtime/include/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/surface/: LAYOUT runtime/include/ runtime/surface/ runtime/bundle/ runtime/base/:
runtime/tissue/: LAYOUT runtime/include/ runtime/tissue/ runtime/base/:
runtime/pose/: LAYOUT runtime/include/ runtime/pose/ runtime/base/:
runtime/tool_shape/: LAYOUT runtime/include/ runtime/tool_shape/ runtime/pose/ runtime/surface/ runtime/base/:
runtime/contact/: LAYOUT runtime/include/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/shape/: LAYOUT runtime/include/ runtime/shape/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/device/: LAYOUT runtime/include/ runtime/device/ runtime/base/:
runtime/scene/: LAYOUT runtime/include/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/large/: LAYOUT runtime/include/ runtime/large/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/cut/: LAYOUT runtime/include/ runtime/cut/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/large/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/inside/: LAYOUT runtime/include/ runtime/inside/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/large/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/crossings/: LAYOUT runtime/include/ runtime/crossings/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/force_control/: LAYOUT runtime/include/ runtime/force_control/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/grasps/: LAYOUT runtime/include/ runtime/grasps/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/fine_surface/: LAYOUT runtime/include/ runtime/fine_surface/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/links/: LAYOUT runtime/include/ runtime/links/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/report/: LAYOUT runtime/include/ runtime/report/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/obstacles/: LAYOUT runtime/include/ runtime/obstacles/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/loads/: LAYOUT runtime/include/ runtime/loads/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/motions/: LAYOUT runtime/include/ runtime/motions/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/needles/: LAYOUT runtime/include/ runtime/needles/ runtime/inside/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/large/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/query/: LAYOUT runtime/include/ runtime/query/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/skin/: LAYOUT runtime/include/ runtime/skin/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/relaxation/: LAYOUT runtime/include/ runtime/relaxation/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/world/: LAYOUT runtime/include/ runtime/world/ runtime/links/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/large/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/complete/: LAYOUT runtime/include/ runtime/complete/ runtime/world/ runtime/crossings/ runtime/cut/ runtime/fine_surface/ runtime/force_control/ runtime/grasps/ runtime/inside/ runtime/links/ runtime/loads/ runtime/motions/ runtime/needles/ runtime/obstacles/ runtime/query/ runtime/relaxation/ runtime/report/ runtime/skin/ runtime/scene/ runtime/shape/ runtime/contact/ runtime/large/ runtime/pose/ runtime/surface/ runtime/tissue/ runtime/bundle/ runtime/dense/ runtime/base/:
runtime/include/: palpate: palpate
programs/player/: programs/player/ runtime/include/ formats/: plumbing VTK palpate
programs/player/tool_turn.cpp: programs/player/ runtime/base/sine.h formats/:
programs/player/organ_motions.cpp: programs/player/ runtime/base/sine.h runtime/include/ formats/: plumbing palpate
programs/player/obstacle_surface.cpp: programs/player/ meshing/surface/surface_file.h meshing/surface/triangle_surface.h runtime/include/ formats/: palpate
programs/player/record.cpp: programs/player/ runtime/include/ formats/: plumbing toml++ palpate
programs/fit/: programs/fit/ programs/player/ studies/hyperelastic/ runtime/large/ runtime/include/ formats/: plumbing Eigen palpate
programs/link/: programs/link/ programs/player/ runtime/include/ formats/: plumbing palpate
programs/organ/: programs/organ/ meshing/image/ meshing/surface/ formats/: plumbing
bindings/python/: bindings/python/: pybind11 palpate
studies/bodies/: studies/bodies/ precompute/elements/ precompute/solver/ formats/: Eigen
studies/bodies/element_truth.h: studies/bodies/ precompute/elements/ precompute/solver/ precompute/tensors/ formats/: Eigen
studies/timing/: studies/timing/:
studies/coupled/: studies/coupled/ runtime/grasps/ runtime/contact/ runtime/surface/: Eigen
studies/coupled/played_world.h: studies/coupled/: Eigen palpate
studies/coupled/played_world.cpp: studies/coupled/ formats/: plumbing Eigen palpate
studies/scenes/: studies/scenes/ studies/coupled/ studies/peers/ studies/accuracy/ studies/timing/ precompute/elements/ formats/: plumbing CLI11 Eigen palpate
studies/peers/: studies/peers/ studies/timing/ precompute/elements/ formats/: plumbing Eigen SuiteSparse palpate
studies/cut/: studies/cut/ studies/accuracy/ studies/hyperelastic/ studies/timing/ precompute/elements/ runtime/cut/ formats/: plumbing Eigen CLI11
studies/hyperelastic/: studies/hyperelastic/ studies/timing/ precompute/elements/ runtime/large/ runtime/base/: Eigen
studies/large/: studies/large/ studies/coupled/ studies/hyperelastic/ studies/accuracy/ studies/timing/ precompute/elements/ formats/: plumbing CLI11 Eigen palpate
studies/played/: studies/played/ studies/hyperelastic/ studies/accuracy/ studies/timing/ programs/player/ runtime/cut/ runtime/large/ runtime/include/ formats/: plumbing CLI11 Eigen
studies/reality/: studies/reality/ studies/validation/ studies/hyperelastic/ studies/bodies/ studies/timing/ precompute/elements/ precompute/solver/ runtime/large/ formats/: plumbing CLI11 Eigen
studies/paper/: studies/paper/ studies/peers/ studies/timing/ precompute/run/ precompute/solver/ runtime/tissue/ formats/: plumbing CLI11 PETSc palpate
studies/accuracy/: studies/accuracy/ studies/timing/ precompute/elements/ precompute/bundle_tool/ runtime/surface/ runtime/base/ formats/: plumbing CLI11 toml++ Eigen palpate
studies/validation/: studies/validation/ studies/accuracy/ studies/hyperelastic/ studies/bodies/ studies/timing/ precompute/elements/ precompute/solver/ precompute/tensors/ formats/: plumbing Eigen palpate
programs/link/igtl_messages.cpp: programs/link/ programs/player/ runtime/include/ formats/: plumbing palpate OpenIGTLink
"""
FOLDERS = "formats meshing precompute runtime programs/player programs/link programs/fit bindings/python studies".split()


def table(text):
    return [[part.strip() for part in line.split(": ")] for line in re.sub(r":$", ": ", text, flags=re.M).strip().splitlines()]


def library_of(name):
    for library, beginnings in table(LIBRARIES):
        if name.startswith(tuple(beginnings.split())):
            return library
    return "a library this table does not know" if re.search("[./]", name) else "system"


def rule_of(file):
    return max((rule for rule in table(RULES) if file.startswith(rule[0])), key=lambda rule: len(rule[0]))


def sources_below(folder, endings):
    return [f for f in sorted((ROOT / folder).rglob("*")) if f.suffix in endings and f.is_file()]


class IncludeTable(unittest.TestCase):
    def test_holds_in_every_folder(self):
        for folder in FOLDERS:
            found = 0
            for source in sources_below(folder, (".h", ".hpp", ".c", ".cpp", ".def")):
                file = str(source.relative_to(ROOT))
                where, own, libraries = rule_of(file)
                for quote, name in re.findall(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', source.read_text(), re.M):
                    found += 1
                    ours = tuple(own.replace("LAYOUT", LAYOUT).split())
                    with self.subTest(file, include=name, rule=where):
                        if quote == '"':
                            self.assertTrue(ours and name.startswith(ours))
                        else:
                            self.assertIn(library_of(name), ["system"] + libraries.split())
            self.assertGreater(found, 10, folder)  # a table over no files would hold anything

    def test_every_program_prints_and_ends_through_formats(self):
        """formats/program.cpp and command_line.cpp know what to do where stderr or stdout takes nothing."""
        own_errors = re.compile(r"print\(stderr|std::cerr|(fprintf|fputs|fwrite|putc)\(.*\bstderr|\bperror\(")
        programs = 0
        for folder in "formats meshing precompute programs studies".split():
            for source in sources_below(folder, (".cpp",)):
                if source.name == "program.cpp" and folder == "formats":
                    continue
                text = source.read_text()
                self.assertIsNone(own_errors.search(text), "%s: say, note and warn of formats/program.h do that" % source)
                if "\nint main(" in text:
                    programs += 1
                    self.assertIn("run_program(", text, source)
        self.assertGreaterEqual(programs, 12)

    def test_libraries_are_told_apart(self):
        found = [library_of(name) for name in ("vector", "sys/mman.h", "hdf5.h", "petscksp.h", "libfoo/foo.h")]
        self.assertEqual(found, ["system", "system", "HDF5", "PETSc", "a library this table does not know"])
        self.assertEqual(rule_of("formats/bundle_reader.cpp")[2], "")
        self.assertEqual(rule_of("programs/player/player.cpp")[0], "programs/player/")


if __name__ == "__main__":
    ROOT = pathlib.Path(sys.argv.pop(1))
    unittest.main(verbosity=2)
