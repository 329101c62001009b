#include "studies/validation/pressed_blocks.h"

#include <fmt/format.h>
#include <fmt/os.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "formats/errors.h"
#include "studies/accuracy/calculix.h"
#include "studies/accuracy/calculix_push.h"
#include "studies/bodies/bodies.h"
#include "studies/timing/timing.h"
#include "studies/validation/baked_body.h"
#include "studies/validation/pressed_bodies.h"

namespace palpate::validation {
namespace {

using Eigen::Vector3d;
using Corners = std::array<double, 3>;

constexpr double kPoisson = 0.45, kYoung[2] = {5400, 8000};  // of the upper block, of the lower one
constexpr double kUpperSide = 0.03, kUpperHeight = 0.02, kLowerSide = 0.06, kLowerHeight = 0.03;  // m
// CalculiX holds the surfaces apart by springs of so many Pa per metre of overlap, a thousand times as stiff as a layer of elements. Ten
// times as stiff, the force changes by 7e-4.
constexpr double kSprings = 1e9;
// Of force and displacements: vertices against triangles here, integration points against triangles there.
constexpr double kBound = 0.03;
// The same where the blocks are a fifth shorter: the lower one folds around the sharp edge of the upper one.
constexpr double kBoundOfLarge = 0.07;

struct Blocks {
  std::string name;
  int cells;                // of the upper block along x and y
  double shift_x, shift_y;  // m, of the upper block
  double pushed;            // m
  bool large = false;       // with large strain
};

struct Block {
  TetrahedralMesh mesh;
  ElasticBody body;  // what is held does not count as touchable
  std::string held;  // the patch
};

Block block(std::array<int, 3> cells, Corners size, Corners low, double young, const char* held, double held_at) {
  Block made = {box_mesh(cells, size), {}, held};
  for (auto& p : made.mesh.nodes)
    for (std::size_t d = 0; d < 3; ++d) p[d] += low[d];
  made.body = held_body(made.mesh, {{young, kPoisson, 0}},
                        [=](const auto& p) { return std::abs(p[2] - held_at) < 1e-9 ? 7 : 0; });
  return made;
}

// Both in the world; the upper one stands on the lower one.
std::array<Block, 2> blocks_of(const Blocks& pair) {
  const double half = kUpperSide / 2;
  return {block({pair.cells, pair.cells, 4}, {kUpperSide, kUpperSide, kUpperHeight},
                {pair.shift_x - half, pair.shift_y - half, kLowerHeight}, kYoung[0], "z1", kLowerHeight + kUpperHeight),
          block({8, 8, 4}, {kLowerSide, kLowerSide, kLowerHeight}, {-kLowerSide / 2, -kLowerSide / 2, 0}, kYoung[1],
                "z0", 0)};
}

// ---- the runtime -------------------------------------------------------------------------------------------------------

PressedAnswer by_runtime(const Workshop& workshop, const std::array<Block, 2>& blocks, double pushed, bool large) {
  Pressing pressing;
  for (std::size_t k = 0; k < 2; ++k) {
    BodyToBake body = {fmt::format("blocks-{}", k), blocks[k].mesh, kYoung[k], kPoisson, Element::p1, ""};
    body.boundary = fmt::format("[[fixed]]\ndofs = \"xyz\"\nselect = {{ patch = \"{}\" }}\n", blocks[k].held);
    body.large = large;
    pressing.bodies.push_back({bake(workshop, body), large ? PALPATE_DEFORMATION_LARGE : PALPATE_DEFORMATION_LINEAR});
  }
  // The lower block comes up, from a tenth of a millimetre below.
  pressing.last = [pushed](double share) {
    palpate_pose pose = palpate_default_pose();
    pose.position[2] = share * pushed - 1e-4 * (1 - share);
    return pose;
  };
  return press(pressing);
}

// ---- CalculiX ----------------------------------------------------------------------------------------------------------

// One body of two regions.
ElasticBody together(const std::array<Block, 2>& blocks) {
  ElasticBody both = blocks[0].body;
  const ElasticBody& lower = blocks[1].body;
  const auto first = static_cast<std::int32_t>(both.nodes.size());
  both.nodes.insert(both.nodes.end(), lower.nodes.begin(), lower.nodes.end());
  both.fixed.insert(both.fixed.end(), lower.fixed.begin(), lower.fixed.end());
  for (auto t : lower.tetrahedra) {
    for (auto& n : t) n += first;
    both.tetrahedra.push_back(t), both.region.push_back(1);
  }
  both.materials.push_back(lower.materials[0]);
  return both;
}

// The faces of cells of one region at the height of the contact, as CalculiX numbers them.
void print_surface(fmt::ostream& out, const char* name, const ElasticBody& body, std::int32_t region) {
  constexpr int faces[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  out.print("*SURFACE, NAME={}, TYPE=ELEMENT\n", name);
  for (std::size_t e = 0; e < body.tetrahedra.size(); ++e)
    for (int f = 0; body.region[e] == region && f < 4; ++f) {
      bool on = true;
      for (const int corner : faces[f]) {
        const auto n = static_cast<std::size_t>(body.tetrahedra[e][static_cast<std::size_t>(corner)]);
        on = on && std::abs(body.nodes[n][2] - kLowerHeight) < 1e-9;
      }
      if (on) out.print("{},S{}\n", e + 1, f + 1);
    }
}

struct CalculixPair {
  std::vector<Vector3d> u;  // of the nodes of both, m
  Vector3d force;           // of the held top on the upper block, N
  double seconds = 0;
};

CalculixPair read_pair(const std::filesystem::path& file, std::size_t nodes) {
  CalculixPair answer = {std::vector<Vector3d>(nodes, Vector3d::Constant(NAN)), Vector3d::Constant(NAN)};
  std::ifstream in(file);
  bool reads_force = false;
  for (std::string line; std::getline(in, line);) {
    if (line.find("total force") != std::string::npos) reads_force = true;
    std::istringstream cells(line);
    Vector3d v;
    if (reads_force) {
      if (cells >> v[0] >> v[1] >> v[2]) answer.force = v, reads_force = false;
    } else if (std::size_t n = 0; cells >> n >> v[0] >> v[1] >> v[2] && n >= 1 && n <= nodes) {
      answer.u[n - 1] = v;
    }
  }
  if (!answer.force.allFinite() || !answer.u.back().allFinite())
    throw OperationError(
        fmt::format("{}: expected the displacements and the force, found no end of the step", file.string()));
  return answer;
}

CalculixPair by_calculix(const std::filesystem::path& folder, const std::array<Block, 2>& blocks, double pushed,
                         bool large) {
  ElasticBody both = together(blocks);
  std::vector<std::size_t> top;
  for (std::size_t n = 0; n < blocks[0].body.nodes.size(); ++n)
    if (both.fixed[n][2]) top.push_back(n), both.fixed[n] = {0, 0, 0};
  std::filesystem::create_directories(folder);
  {
    auto out = fmt::output_file((folder / "blocks.inp").string());
    accuracy::write_calculix_model(
        out, both,
        accuracy::linear_model(both, large ? accuracy::neo_hookean_words(kPoisson) : accuracy::elastic_words));
    out.print("*NSET, NSET=TOP\n");
    for (const auto n : top) out.print("{},\n", n + 1);
    print_surface(out, "UPPER", both, 0);
    print_surface(out, "LOWER", both, 1);
    out.print(
        "*SURFACE INTERACTION, NAME=APART\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{:g}\n"
        "*CONTACT PAIR, INTERACTION=APART, TYPE=SURFACE TO SURFACE\nUPPER, LOWER\n"
        "*STEP, {}INC=200\n*STATIC\n0.5,1.,1e-5,1.\n*BOUNDARY\nTOP,1,2\nTOP,3,3,{:.12e}\n"
        "*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=1000\nRF\n*END STEP\n",
        kSprings, large ? "NLGEOM, " : "", -pushed);
  }
  const auto asked = studies::Clock::now();
  accuracy::run_calculix(folder, "blocks");
  CalculixPair answer = read_pair(folder / "blocks.dat", both.nodes.size());
  answer.seconds = studies::seconds_since(asked);
  std::filesystem::remove_all(folder);
  return answer;
}

// ---- both --------------------------------------------------------------------------------------------------------------

Agreement compare(const Workshop& workshop, const Blocks& pair, const std::filesystem::path& scratch) {
  const std::array<Block, 2> blocks = blocks_of(pair);
  const PressedAnswer ours = by_runtime(workshop, blocks, pair.pushed, pair.large);
  const CalculixPair theirs = by_calculix(scratch, blocks, pair.pushed, pair.large);
  double largest = 0, worst = 0;
  std::size_t first = 0, cells = 0;
  // There the upper block's top has come down; here the lower block has come up.
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t n = 0; n < ours.u[k].size(); ++n) {
      const Vector3d there = theirs.u[first + n] + (k == 0 ? Vector3d(0, 0, pair.pushed) : Vector3d::Zero());
      largest = std::max(largest, there.norm()), worst = std::max(worst, (ours.u[k][n] - there).norm());
    }
    first += blocks[k].body.nodes.size(), cells += blocks[k].body.tetrahedra.size();
  }
  // What the top does to the upper block is what the upper block does to the lower one.
  const double force_off = (ours.force - theirs.force).norm() / theirs.force.norm();
  return {first, first, cells, std::max(worst / largest, force_off), 0, ours.seconds, theirs.seconds};
}

}  // namespace

std::vector<CalculixMesh> pressed_block_pairs(const Workshop& workshop) {
  std::vector<CalculixMesh> all;
  for (const Blocks& pair :
       {Blocks{"two blocks in contact, vertices on vertices", 4, 0, 0, 1e-3},
        Blocks{"two blocks in contact, other meshes", 6, 0, 0, 1e-3},
        Blocks{"two blocks in contact, other meshes, shifted", 6, 0.0023, -0.0011, 1e-3},
        Blocks{"two blocks pressed together by a fifth, large strain, vertices on vertices", 4, 0, 0, 10e-3, true},
        Blocks{"two blocks pressed together by a fifth, large strain, other meshes", 6, 0, 0, 10e-3, true}}) {
    CalculixMesh mesh = {
        pair.name, Element::p1, fmt::format("{:g}", kPoisson), pair.large ? kBoundOfLarge : kBound, {}};
    mesh.compare = [=](const std::filesystem::path& scratch) { return compare(workshop, pair, scratch); };
    all.push_back(std::move(mesh));
  }
  return all;
}

}  // namespace palpate::validation
