// Compares every #include of our sources with the table of what each folder may depend on.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace {

using Words = std::vector<std::string>;

bool starts_with_any(const std::string& text, const Words& prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](const std::string& p) { return text.rfind(p, 0) == 0; });
}

// The library that an #include <...> belongs to.
std::string library_of(const std::string& include) {
  static const std::vector<std::pair<std::string, Words>> libraries = {
      {"system",
       {"assert.h", "dlfcn.h",  "errno.h",  "fcntl.h",   "float.h",   "glob.h",   "limits.h",  "math.h",     "netdb.h",
        "elf.h",    "link.h",   "netinet/", "poll.h",    "pthread.h", "sched.h",  "setjmp.h",  "signal.h",   "std",
        "malloc.h", "string.h", "sys/",     "termios.h", "time.h",    "unistd.h", "windows.h", "immintrin.h"}},
      {"HDF5", {"hdf5", "H5"}},
      {"MPI", {"mpi.h"}},
      {"PETSc", {"petsc"}},
      {"SuiteSparse", {"suitesparse/"}},
      {"Eigen", {"Eigen/"}},
      {"CGAL", {"CGAL/", "boost/"}},
      {"gmsh", {"gmsh"}},
      {"ITK", {"itk"}},
      {"libpng", {"png.h"}},
      {"VTK", {"vtk"}},
      {"zlib", {"zlib.h"}},
      {"pybind11", {"pybind11/"}},
      {"OpenIGTLink", {"igtl"}},
      // CLI11 and toml++ take seconds to compile: mains include the one, two sources the other.
      {"CLI11", {"CLI/"}},
      {"toml++", {"toml++/"}},
      {"plumbing", {"fmt/", "spdlog/", "nlohmann/", "openssl/"}},
      {"palpate", {"palpate/"}}};
  for (const auto& [library, prefixes] : libraries)
    if (starts_with_any(include, prefixes)) return library;
  const bool standard = include.find_first_of("./") == std::string::npos;
  return standard ? "system" : "a library this table does not know";
}

struct Rule {
  std::string where;  // path prefix; the longest that fits decides
  Words own;          // prefixes of our own headers
  Words libraries;
};

// Data flows one way. The runtime needs a compiler and the bundle layout alone.
const std::vector<Rule>& rules() {
  static const Words layout = {"formats/bundle_layout.h", "formats/bundle_reader.h", "formats/bundle_sections.def",
                               "formats/checksum.h",      "formats/half.h",          "formats/compliance_blocks.h",
                               "formats/response_check.h"};
  const auto runtime_room = [](const Words& rooms) {
    Words own = layout;
    own.push_back("runtime/include/");
    for (const std::string& room : rooms) own.push_back("runtime/" + room);
    return own;
  };
  static const std::vector<Rule> table = {
      {"formats/", {"formats/"}, {"plumbing"}},
      {"formats/bundle_writer.cpp", {"formats/"}, {"plumbing", "HDF5"}},
      {"formats/command_line.cpp", {"formats/"}, {"plumbing", "CLI11"}},
      {"formats/toml_reader.cpp", {"formats/"}, {"plumbing", "toml++"}},
      {"formats/bundle_layout.h", layout, {}},
      {"formats/bundle_reader.", layout, {}},
      {"formats/bundle_sections.def", layout, {}},
      {"formats/checksum.", layout, {}},
      {"formats/half.h", layout, {}},
      {"formats/compliance_blocks.h", layout, {}},
      {"formats/response_check.", layout, {}},
      // Rooms, in the direction of the data: each may use those above it that it names.
      {"meshing/image/", {"meshing/image/", "formats/"}, {"plumbing", "libpng", "zlib"}},
      {"meshing/image/thickness.cpp", {"meshing/image/"}, {"ITK"}},
      {"meshing/surface/", {"meshing/surface/", "meshing/image/", "formats/"}, {"plumbing", "Eigen", "CGAL", "VTK"}},
      {"meshing/tetrahedra/",
       {"meshing/tetrahedra/", "meshing/surface/", "meshing/image/", "formats/"},
       {"plumbing", "Eigen", "CGAL", "gmsh"}},
      // A boundary file may select nodes by a label image.
      {"precompute/elements/", {"precompute/elements/", "meshing/image/", "formats/"}, {"plumbing", "Eigen"}},
      {"precompute/solver/",
       {"precompute/solver/", "precompute/elements/", "formats/"},
       {"plumbing", "PETSc", "MPI", "SuiteSparse", "Eigen"}},
      {"precompute/ranks/",
       {"precompute/ranks/", "precompute/solver/", "precompute/elements/", "formats/"},
       {"plumbing", "PETSc", "MPI"}},
      {"precompute/tensors/",
       {"precompute/tensors/", "precompute/solver/", "precompute/elements/", "formats/"},
       {"plumbing", "Eigen"}},
      {"precompute/journal/",
       {"precompute/journal/", "precompute/tensors/", "precompute/elements/", "formats/"},
       {"plumbing"}},
      {"precompute/run/", {"precompute/", "formats/"}, {"plumbing", "MPI", "Eigen"}},
      {"precompute/bundle_tool/",
       {"precompute/bundle_tool/", "precompute/tensors/", "precompute/solver/", "precompute/elements/", "formats/"},
       {"plumbing", "PETSc", "Eigen"}},
      {"runtime/base/", runtime_room({"base/"}), {}},
      {"runtime/dense/", runtime_room({"dense/", "base/"}), {}},
      {"runtime/bundle/", runtime_room({"bundle/", "dense/", "base/"}), {}},
      {"runtime/surface/", runtime_room({"surface/", "bundle/", "base/"}), {}},
      {"runtime/tissue/", runtime_room({"tissue/", "base/"}), {}},
      {"runtime/pose/", runtime_room({"pose/", "base/"}), {}},
      {"runtime/tool_shape/", runtime_room({"tool_shape/", "pose/", "surface/", "base/"}), {}},
      {"runtime/large/", runtime_room({"large/", "base/"}), {}},
      {"runtime/contact/",
       runtime_room({"contact/", "inside/", "large/", "pose/", "surface/", "tissue/", "bundle/", "dense/", "base/"}),
       {}},
      {"runtime/inside/", runtime_room({"inside/", "large/", "surface/", "base/"}), {}},
      {"runtime/query/", runtime_room({"query/", "surface/", "bundle/", "base/"}), {}},
      {"runtime/shape/", runtime_room({"shape/", "surface/", "tissue/", "bundle/", "dense/", "base/"}), {}},
      {"runtime/device/", runtime_room({"device/", "base/"}), {}},
      {"runtime/scene/",
       runtime_room({"scene/", "shape/", "inside/", "query/", "contact/", "large/", "pose/", "surface/", "tissue/",
                     "bundle/", "dense/", "base/"}),
       {}},
      {"runtime/world/",
       runtime_room({"world/", "scene/", "shape/", "inside/", "query/", "contact/", "large/", "pose/", "surface/",
                     "tissue/", "bundle/", "dense/", "base/"}),
       {}},
      {"runtime/include/", {"palpate.h"}, {"palpate"}},
      {"programs/player/", {"programs/player/", "runtime/include/", "formats/"}, {"plumbing", "VTK", "palpate"}},
      {"programs/player/tool_turn.cpp", {"programs/player/", "runtime/base/sine.h", "formats/"}, {}},
      {"programs/player/record.cpp",
       {"programs/player/", "runtime/include/", "formats/"},
       {"plumbing", "toml++", "palpate"}},
      {"programs/fit/", {"programs/fit/", "programs/player/", "runtime/include/", "formats/"}, {"plumbing", "palpate"}},
      {"programs/link/",
       {"programs/link/", "programs/player/", "runtime/include/", "formats/"},
       {"plumbing", "palpate"}},
      {"programs/organ/", {"programs/organ/", "meshing/image/", "meshing/surface/", "formats/"}, {"plumbing"}},
      {"bindings/python/", {"bindings/python/"}, {"pybind11", "palpate"}},
      // What users run: never bench/ or tests/, and of the programs none.
      {"studies/bodies/", {"studies/bodies/", "precompute/elements/", "precompute/solver/", "formats/"}, {"Eigen"}},
      {"studies/timing/", {"studies/timing/"}, {}},
      {"studies/coupled/", {"studies/coupled/", "runtime/contact/", "runtime/surface/"}, {"Eigen"}},
      {"studies/scenes/",
       {"studies/scenes/", "studies/coupled/", "studies/peers/", "studies/accuracy/", "studies/timing/",
        "precompute/elements/", "formats/"},
       {"plumbing", "CLI11", "Eigen", "palpate"}},
      {"studies/peers/",
       {"studies/peers/", "studies/timing/", "precompute/elements/", "formats/"},
       {"plumbing", "Eigen", "SuiteSparse", "palpate"}},
      {"studies/hyperelastic/",
       {"studies/hyperelastic/", "studies/timing/", "precompute/elements/", "runtime/large/", "runtime/base/"},
       {"Eigen"}},
      {"studies/large/",
       {"studies/large/", "studies/hyperelastic/", "studies/accuracy/", "studies/timing/", "precompute/elements/",
        "formats/"},
       {"plumbing", "CLI11", "Eigen", "palpate"}},
      {"studies/paper/",
       {"studies/paper/", "studies/peers/", "studies/timing/", "precompute/run/", "precompute/solver/",
        "runtime/tissue/", "formats/"},
       {"plumbing", "CLI11", "PETSc", "palpate"}},
      {"studies/accuracy/",
       {"studies/accuracy/", "studies/timing/", "precompute/elements/", "precompute/bundle_tool/", "runtime/surface/",
        "runtime/base/", "formats/"},
       {"plumbing", "CLI11", "toml++", "Eigen", "palpate"}},
      {"studies/validation/",
       {"studies/validation/", "studies/accuracy/", "studies/hyperelastic/", "studies/bodies/", "studies/timing/",
        "precompute/elements/", "precompute/solver/", "precompute/tensors/", "formats/"},
       {"plumbing", "Eigen", "palpate"}},
      {"programs/link/igtl_messages.cpp",
       {"programs/link/", "programs/player/", "runtime/include/", "formats/"},
       {"plumbing", "palpate", "OpenIGTLink"}},
  };
  return table;
}

const Rule& rule_of(const std::string& file) {
  const Rule* longest = nullptr;
  for (const Rule& rule : rules())
    if (file.rfind(rule.where, 0) == 0 && (!longest || rule.where.size() > longest->where.size())) longest = &rule;
  return *longest;
}

struct Include {
  std::string file, name;
  int line;
  bool own;  // "..." and not <...>
};

std::vector<Include> includes_below(const std::filesystem::path& root, const std::string& folder) {
  static const std::regex pattern(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
    const std::string extension = entry.path().extension().string();
    const Words sources = {".h", ".hpp", ".c", ".cpp", ".def"};
    if (!entry.is_regular_file() || std::find(sources.begin(), sources.end(), extension) == sources.end()) continue;
    std::ifstream in(entry.path());
    std::string line;
    for (int number = 1; std::getline(in, line); ++number)
      if (std::smatch match; std::regex_search(line, match, pattern))
        found.push_back(
            {std::filesystem::relative(entry.path(), root).generic_string(), match[2], number, match[1] == "\""});
  }
  return found;
}

TEST(IncludeTable, HoldsInEveryFolder) {
  const std::filesystem::path root = PALPATE_SOURCE_FOLDER;
  for (const std::string folder : {"formats", "meshing", "precompute", "runtime", "programs/player", "programs/link",
                                   "programs/fit", "bindings/python", "studies"}) {
    const auto includes = includes_below(root, folder);
    EXPECT_GT(includes.size(), 10u) << folder;  // a table over no files would hold anything
    for (const Include& include : includes) {
      const Rule& rule = rule_of(include.file);
      const std::string library = include.own ? "" : library_of(include.name);
      const bool allowed = include.own ? starts_with_any(include.name, rule.own)
                                       : library == "system" || std::find(rule.libraries.begin(), rule.libraries.end(),
                                                                          library) != rule.libraries.end();
      EXPECT_TRUE(allowed) << include.file << ":" << include.line << ": includes " << include.name
                           << (include.own ? "" : ", which is of " + library) << "; " << rule.where << " may not";
    }
  }
}

// formats/program.cpp and command_line.cpp know what to do where stderr or stdout takes nothing.
TEST(IncludeTable, EveryProgramPrintsAndEndsThroughFormats) {
  const std::filesystem::path root = PALPATE_SOURCE_FOLDER;
  const std::regex own_errors("print\\(stderr|std::cerr|(fprintf|fputs|fwrite|putc)\\(.*\\bstderr|\\bperror\\(");
  int programs = 0;
  for (const std::string folder : {"formats", "meshing", "precompute", "programs", "studies"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      const std::string file = std::filesystem::relative(entry.path(), root).generic_string();
      if (!entry.path().string().ends_with(".cpp") || file == "formats/program.cpp") continue;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      EXPECT_FALSE(std::regex_search(text, own_errors)) << file << ": say, note and warn of formats/program.h do that";
      if (text.find("\nint main(") == std::string::npos) continue;
      ++programs;
      EXPECT_NE(text.find("run_program("), std::string::npos) << file;
    }
  EXPECT_GE(programs, 12);
}

TEST(IncludeTable, TellsLibrariesApart) {
  EXPECT_EQ(library_of("vector"), "system");
  EXPECT_EQ(library_of("sys/mman.h"), "system");
  EXPECT_EQ(library_of("hdf5.h"), "HDF5");
  EXPECT_EQ(library_of("petscksp.h"), "PETSc");
  EXPECT_EQ(library_of("libfoo/foo.h"), "a library this table does not know");
  EXPECT_EQ(rule_of("formats/bundle_reader.cpp").libraries, Words{});
  EXPECT_EQ(rule_of("programs/player/player.cpp").where, "programs/player/");
}

}  // namespace
