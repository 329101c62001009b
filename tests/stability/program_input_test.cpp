// NaN, infinities, denormals and huge numbers in every file and option that the programs read. A program must answer with one
// sentence and exit code 2, or with a right result; never with a crash, a hang, or an output that contains such numbers.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <regex>

#include "tests/stability/programs.h"
#include "tests/stability/stability_case.h"
#include "tests/support/msh_files.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

// The quick form tries the first three.
std::vector<std::string> odd_words() {
  const std::vector<std::string> words = {"nan", "1e200", "1e-320", "-0.0", "inf", "-inf", "1e308", "-1e200"};
  return {words.begin(), words.begin() + quick_or_long(3, static_cast<int>(words.size()))};
}
bool is_number(const std::string& word) {
  return word.find_first_of("nN") == std::string::npos;
}
bool is_all_but_zero(const std::string& word) {
  return word == "1e-320" || word == "-0.0";
}

// Judges runs: each must either refuse the input as it should, or give a right answer.
class Verdicts {
 public:
  explicit Verdicts(Programs& programs) : programs_(programs) {}

  // named: text that a refusal must contain. answer_is_right: asked where the run ends with exit code 0.
  void judge(const std::string& what, const std::string& word, const ProgramRun& ended, const std::string& named,
             const std::function<bool()>& answer_is_right, const std::string& output) {
    ++runs_;
    std::string wrong;
    if (ended.code == 0) {
      if (!is_number(word))
        wrong = "was taken";
      else if (!answer_is_right())
        wrong = "gave a wrong answer";
    } else {
      const std::string last = last_line(ended.errors);
      if (ended.code != 2)
        wrong = fmt::format("ended with {}", ended.code);
      else if (last.find(named) == std::string::npos || last.size() > 500)
        wrong = "was refused without its place";
      else if (!output.empty() && programs_.left_anything(output))
        wrong = "was refused and left an output";
    }
    if (wrong.empty()) return;
    ++wrong_;
    if (wrong_ < 10) ADD_FAILURE() << what << " = " << word << " " << wrong << ": " << ended.errors;
  }
  // Of a precompute.
  void judge_bundle(const std::string& what, const std::string& word, const std::string& named) {
    const ProgramRun ended = programs_.precompute("x.h5");
    judge(
        what, word, ended, named, [&] { return programs_.verifies("x.h5"); }, "x.h5");
  }
  // Of odd.toml, played.
  void judge_scene(const std::string& what, const std::string& word, const std::string& text,
                   const std::string& named = "odd.toml") {
    programs_.write("odd.toml", text);
    const ProgramRun ended = programs_.run("odd.toml -o out --quiet");
    judge(
        what, word, ended, named, [&] { return programs_.holds_only_numbers("out"); }, "out");
    std::filesystem::remove_all(programs_.folder() / "out");
  }
  void hold(StabilityCase& attack) const {
    attack.hold(
        fmt::format("runs of {} that neither gave a correct answer nor refused the input in one sentence", runs_),
        static_cast<double>(wrong_), 0,
        "refusal: exit code 2, names file and place, leaves no file; or a correct answer");
  }

 private:
  static std::string last_line(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text.substr(text.rfind('\n') + 1);
  }
  Programs& programs_;
  long runs_ = 0, wrong_ = 0;
};

TEST(StabilityProgramInput, OrganAndBoundaryFiles) {
  StabilityCase attack(
      "TOML allows nan and inf, and a wrong unit makes 1e308. Every comparison with NaN is false, so that a check "
      "written the wrong way round lets it through to an hour of solving, or into the bundle.");
  Programs programs;
  Verdicts verdicts(programs);
  const auto try_all = [&](const std::string& file, const std::string& good, const std::string& field,
                           const std::string& before, const std::string& after) {
    for (const std::string& word : odd_words()) {
      programs.write(file, replaced(good, field, before + word + after));
      verdicts.judge_bundle(file + ": " + before, word, ".toml");
    }
    programs.write(file, good);
  };
  const std::string organ = programs.organ();
  try_all("organ.toml", organ, "value = 5.4", "value = ", "");
  try_all("organ.toml", organ, "value = 0.45", "value = ", "");
  try_all("organ.toml", organ, "value = 1060", "value = ", "");
  const auto select = [](const std::string& what) {
    return "name = \"x\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { " + what + " }\n";
  };
  const std::string half = select("half_space = { point = [1, 2, 3], normal = [4, 0, 0] }");
  try_all("bc.toml", half, "[1, ", "[", ", ");
  try_all("bc.toml", half, "[4, ", "[", ", ");
  const std::string box = select("box = { min = [-1, -1, -1], max = [1, 99, 99] }");
  try_all("bc.toml", box, "[1, 99", "[", ", 99");
  try_all("bc.toml", box, "[-1, ", "[", ", ");
  const std::string sphere = select("sphere = { center = [0, 25, 20], radius = 30 }");
  try_all("bc.toml", sphere, "[0, 25", "[", ", 25");
  try_all("bc.toml", sphere, "radius = 30", "radius = ", "");
  const std::string nearest = select("nearest = { points = [[0, 0, 0], [0, 0, 40], [0, 50, 20]] }");
  try_all("bc.toml", nearest, "50, 20]", "", ", 20]");
  const std::string quantile = select("below_quantile = { direction = [1, 0, 0], quantile = 0.2 }");
  try_all("bc.toml", quantile, "[1, ", "[", ", ");
  try_all("bc.toml", quantile, "0.2", "", "");
  const std::string preload = half + "[preload]\ngravity = { value = [0, 0, -9.81], unit = \"m/s^2\" }\n";
  try_all("bc.toml", preload, "-9.81", "", "");
  verdicts.hold(attack);
}

TEST(StabilityProgramInput, MeasuredCurves) {
  StabilityCase attack("One NaN among the measured points makes every coefficient of the fit NaN.");
  Programs programs;
  Verdicts verdicts(programs);
  programs.write("organ.toml", programs.organ() +
                                   "[response]\ncurve = \"curve.csv\"\nsource = \"test\"\n"
                                   "height = { value = 10, unit = \"mm\" }\nradius = { value = 10, unit = \"mm\" }\n"
                                   "young = { value = 5.4, unit = \"kPa\", source = \"t\" }\n"
                                   "poisson = { value = 0.45, source = \"t\" }\n");
  const std::string curve = "displacement_mm,force_N\n0.5,0.1\n1,0.25\n1.5,0.5\n2,0.9\n2.5,1.5\n";
  for (const char* const field : {"1.5,", "0.25"})
    for (const std::string& word : odd_words()) {
      programs.write("curve.csv", replaced(curve, field, word + (field[3] == ',' ? "," : "")));
      verdicts.judge_bundle(field, word, "curve.csv");
    }
  programs.write("curve.csv", curve);
  EXPECT_EQ(programs.precompute("x.h5").code, 0);
  verdicts.hold(attack);
}

TEST(StabilityProgramInput, MeshFilesInEveryForm) {
  StabilityCase attack(
      "A coordinate that is NaN, in text or in the bytes of a binary mesh: volumes become NaN, which is neither above "
      "nor below zero.");
  Programs programs;
  Verdicts verdicts(programs);
  const TetrahedralMesh good = programs.mesh();
  const std::size_t middle = good.nodes.size() / 2;
  for (const std::string& word : odd_words())
    for (const std::size_t d : {0u, 2u}) {
      if (d > 0 && quick_or_long(true, false)) continue;
      TetrahedralMesh mesh = good;
      mesh.nodes[middle][d] = std::strtod(word.c_str(), nullptr);
      for (const auto& [form, bytes] : {std::pair{"2.2 text", msh2_ascii(mesh)},
                                        {"2.2 binary", msh2_binary(mesh)},
                                        {"4.1 binary", msh4_binary(mesh)}}) {
        programs.write("box.msh", bytes);
        verdicts.judge_bundle(form, word, is_number(word) ? "box.msh" : "has the coordinate");
      }
    }
  // A body that is scaled by each number.
  for (const std::string& word : odd_words()) {
    TetrahedralMesh mesh = good;
    for (auto& p : mesh.nodes)
      for (double& x : p) x *= std::strtod(word.c_str(), nullptr);
    programs.write("box.msh", msh2_ascii(mesh));
    verdicts.judge_bundle("whole mesh", word, "box.msh");
  }
  verdicts.hold(attack);
}

TEST(StabilityProgramInput, ScenesAndToolPaths) {
  StabilityCase attack(
      "A scene with extreme numbers could play for ever, write NaN into its results, or leave a folder that looks like "
      "a finished run.");
  Programs programs;
  ASSERT_EQ(programs.precompute("box.h5").code, 0);
  Verdicts verdicts(programs);
  const std::string scene = R"(name = "odd"
bundle = "box.h5"
unit = "mm"
[effects]
law = "coulomb"
[relaxation]
terms = [[0.31, 0.51]]
source = "test"
[rate]
touch = 200
shape = 20
[limits]
force = 50
force_slew = 1e4
[[tool]]
name = "disc"
points = [[0.5, 0, 0]]
disc_radius = 3
friction = 0.21
path = [[0, 41, 26, 45], [0.12, 42, 26, 36]]
[[tool]]
name = "rod"
capsule = { radius = 2.5, length = 11, axis = [0, 0, 1], samples = 10 }
path_csv = "odd.csv"
[[tool]]
name = "grip"
path = [[0, 0, 0, 0], [0.05, 0, 0, 1.5]]
[[tool.grip]]
nearest = [60, 50, 40]
[[tool.grip]]
box = { min = [59, -1, -1], max = [61, 1, 1] }
)";
  const std::string rod = "time,x,y,z\n0,20,25,60\n0.1,20,25,52\n";
  programs.write("odd.csv", rod);
  programs.write("odd.toml", scene);
  const ProgramRun good = programs.run("odd.toml -o out --quiet");
  ASSERT_EQ(good.code, 0) << good.errors;
  std::filesystem::remove_all(programs.folder() / "out");
  for (const char* const field : {"0.31", "0.51", "200", "20\n", "50\n", "1e4", "0.5,", "3\n", "0.21", "0.12", "42",
                                  "2.5", "11", " 1]", "0.05", "1.5", "40]", "59", "61"}) {
    const std::string text = field,
                      tail = std::isdigit(text.back()) || text.back() == '5' ? "" : text.substr(text.size() - 1);
    for (const std::string& word : odd_words())
      verdicts.judge_scene(field, word, replaced(scene, field, " " + word + tail));
  }
  // A path of 30 years: every answer is wrong, because its steps are more than the program can count.
  for (const std::string word : {"1e9", "1e308"}) {
    programs.write("odd.toml", replaced(scene, "0.12", word));
    verdicts.judge(
        "a path's last time", word, programs.run("odd.toml -o out --quiet"), "odd.toml: rate.touch",
        [] { return false; }, "out");
  }
  for (const char* const field : {"0.1,", "52"})
    for (const std::string& word : odd_words()) {
      programs.write("odd.csv", replaced(rod, field, word + (field[0] == '0' ? "," : "")));
      verdicts.judge_scene(field, word, scene, is_number(word) ? "odd." : "odd.csv");
    }
  verdicts.hold(attack);
}

TEST(StabilityProgramInput, ScenesWithNeedles) {
  StabilityCase attack(
      "A needle with extreme numbers: a shaft so thin that its compliance overflows, a way that never ends in the "
      "tissue, "
      "forces that are not numbers.");
  Programs programs;
  Verdicts verdicts(programs);
  programs.write("bc.toml",
                 kBoundary + "[[corridor]]\nname = \"along\"\nfrom = [70, 25, 20]\nto = [0, 25, 20]\nradius = 5\n");
  const ProgramRun made = programs.precompute("box.h5");
  ASSERT_EQ(made.code, 0) << made.errors;
  const std::string scene = R"(name = "odd"
bundle = "box.h5"
unit = "mm"
[[tool]]
name = "needle"
path = [[0, 62, 26, 21], [0.1, 31, 26, 21], [0.2, 63, 26, 21]]
turn = [[0, 0, 0, 0], [0.2, 0, 0, 7]]
[tool.needle]
entry = [59, 26, 21]
direction = [-11, 0.25, 0]
radius = 0.6
friction = 3
puncture_force = 0.2
cutting_force = 0.05
spacing = 5
)";
  programs.write("odd.toml", scene);
  const ProgramRun good = programs.run("odd.toml -o out --quiet");
  ASSERT_EQ(good.code, 0) << good.errors;
  EXPECT_THAT(file_bytes(programs.folder() / "out/needles.csv"), ::testing::HasSubstr("cuts"));
  std::filesystem::remove_all(programs.folder() / "out");
  for (const std::string field : {"31,", "7]", "59,", "-11,", "0.25,", "0.6\n", "3\n", "0.2\n", "0.05\n", "5\n"})
    for (const std::string& word : odd_words()) {
      const std::string key = field == "3\n" ? "friction = 3\n" : field == "5\n" ? "spacing = 5\n" : field;
      const std::string before = key.substr(0, key.size() - field.size());
      verdicts.judge_scene(key, word, replaced(scene, key, before + " " + word + field.substr(field.size() - 1)));
    }
  verdicts.hold(attack);
}

TEST(StabilityProgramInput, SurfacesInEveryForm) {
  StabilityCase attack("A surface with one point at NaN passes every check of topology.");
  Programs programs;
  Verdicts verdicts(programs);
  // A cube with two triangles on each face; @ stands for one coordinate.
  const char* const points[8] = {"0 0 0", "10 0 0", "10 10 0", "0 10 0", "0 0 10", "10 0 10", "@ 10 10", "0 10 10"};
  const int faces[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                            {2, 3, 7}, {2, 7, 6}, {1, 2, 6}, {1, 6, 5}, {0, 4, 7}, {0, 7, 3}};
  std::string off = "OFF\n8 12 0\n", obj, stl = "solid cube\n";
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
  for (const char* p : points)
    off += std::string(p) + "\n", ply += std::string(p) + "\n", obj += "v " + std::string(p) + "\n";
  for (const auto& f : faces) {
    off += fmt::format("3 {} {} {}\n", f[0], f[1], f[2]), ply += fmt::format("3 {} {} {}\n", f[0], f[1], f[2]);
    obj += fmt::format("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1);
    stl += "facet normal 0 0 0\nouter loop\n";
    for (const int v : f) stl += std::string("vertex ") + points[v] + "\n";
    stl += "endloop\nendfacet\n";
  }
  stl += "endsolid cube\n";
  for (const auto& [name, text] :
       {std::pair{"cube.off", off}, {"cube.ply", ply}, {"cube.obj", obj}, {"cube.stl", stl}}) {
    for (const std::string& word : odd_words()) {
      if (is_all_but_zero(word)) continue;  // almost zero: the result is only a cube of another shape
      programs.write(name, std::regex_replace(text, std::regex("@"), word));
      for (const bool tetrahedra : {false, true}) {
        const std::string out = tetrahedra ? "out.msh" : "out.off";
        std::filesystem::remove(programs.folder() / out);
        const ProgramRun ended =
            programs.execute((tetrahedra ? PALPATE_TETRAHEDRA : PALPATE_SURFACE) + std::string(" ") + name + " -o " +
                             out + (tetrahedra ? " --goal 0 --min-dihedral 0" : ""));
        verdicts.judge(
            name, word, ended, is_number(word) ? name : "finite", [] { return false; }, out);
      }
    }
    programs.write(name, std::regex_replace(text, std::regex("@"), "10"));
    EXPECT_EQ(programs.execute(std::string(PALPATE_SURFACE) + " " + name + " -o out.off").code, 0) << name;
  }
  verdicts.hold(attack);
}

TEST(StabilityProgramInput, HeadersOfImages) {
  StabilityCase attack("The size of a voxel comes from a header that any program may have written.");
  Programs programs;
  Verdicts verdicts(programs);
  std::string voxels(32 * 32 * 32, '\0');
  for (int k = 6; k < 26; ++k)
    for (int j = 6; j < 26; ++j) std::fill_n(voxels.begin() + 32 * (32 * k + j) + 6, 20, '\1');
  const std::string nrrd =
      "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 32 32 32\n"
      "space directions: (@,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nencoding: raw\n"
      "space origin: (#,0,0)\n\n" +
      voxels;
  const std::string mha =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      "CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = # 0 0\n"
      "ElementSpacing = @ 1 1\nDimSize = 32 32 32\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
      voxels;
  const auto text = [](std::string of, const std::string& spacing, const std::string& origin) {
    return replaced(replaced(std::move(of), "@", spacing), "#", origin);
  };
  for (const auto& [name, header] : {std::pair{"cube.nrrd", nrrd}, {"cube.mha", mha}}) {
    programs.write(name, text(header, "1", "0"));
    const std::string command = std::string(PALPATE_SURFACE) + " " + name + " --labels 1 -o out.off";
    const ProgramRun good = programs.execute(command);
    EXPECT_EQ(good.code, 0) << good.errors;
    std::filesystem::remove(programs.folder() / "out.off");
    std::vector<std::string> words = odd_words();
    words.push_back("1e-12");  // a voxel much thinner than in any scan, which would take for ever to mesh
    for (const std::string& word : words)
      for (const bool spacing : {true, false}) {
        if (!spacing && (is_all_but_zero(word) || word == "1e-12"))
          continue;  // an origin that is almost zero is a good one
        programs.write(name, text(header, spacing ? word : "1", spacing ? "0" : word));
        verdicts.judge(
            std::string(name) + (spacing ? " spacing" : " origin"), word, programs.execute(command),
            spacing ? "correct the header" : name, [] { return false; }, "out.off");
        std::filesystem::remove(programs.folder() / "out.off");
      }
  }
  verdicts.hold(attack);
}

TEST(StabilityProgramInput, NumbersOnCommandLines) {
  StabilityCase attack("A range check is two comparisons, and NaN passes both.");
  Programs programs;
  Verdicts verdicts(programs);
  const std::pair<const char*, std::vector<const char*>> options[] = {
      {PALPATE_PRECOMPUTE " box.msh --organ organ.toml --boundary bc.toml -o x.h5",
       {"--tolerance", "--memory", "--batch", "--ranks-per-operator"}},
      {PALPATE_BUNDLE " pack none.h5 -o x.h5", {"--low-rank"}},
      {PALPATE_RUN " none.toml --realtime", {"--seconds", "--rate"}},
      {PALPATE_FEEL " none.toml --to 1", {"--seconds"}},
      {PALPATE_DRAW " none.toml --from 0", {"--seconds", "--silence", "--every"}},
      {PALPATE_IGTL " none.toml", {"--seconds", "--surface-rate", "--force-rate"}},
      {PALPATE_SURFACE " none.off -o x.off", {"--edge-mm", "--smooth", "--threshold", "--labels", "--triangles"}},
      {PALPATE_TETRAHEDRA " none.off -o x.msh",
       {"--size", "--optimize-below", "--goal", "--min-dihedral", "--min-radius-ratio", "--time-limit", "--edge-mm",
        "--facet-distance"}},
  };
  for (const auto& [command, names] : options)
    for (const char* const name : names)
      for (const std::string word : {"nan", "-inf"})
        verdicts.judge(
            name, word, programs.execute(std::string(command) + " " + name + "=" + word), name, [] { return false; },
            "x.h5");
  verdicts.hold(attack);
}

}  // namespace
}  // namespace palpate::tests
