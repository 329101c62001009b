#include "studies/validation/pressed_blocks.h"

#include <fmt/format.h>
#include <fmt/os.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <span>
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
constexpr double kLayer = 0.006;  // m, thinner than a layer of cells is high
// CalculiX holds the surfaces apart by springs of so many Pa per metre of overlap, a thousand times as stiff as a layer of elements. Ten
// times as stiff, the force changes by 7e-4.
constexpr double kSprings = 1e9;
// Of forces and displacements, and of pressures: vertices against triangles here, integration points against triangles there.
constexpr double kBound = 0.03, kBoundOfPressure = 0.05;

// Under large strain the blocks are a fifth shorter, and without friction hardly anything holds them against a way to the side: meshes and
// contact decide it, and displacements are not compared.
enum class Compared { linear, large_force, large_pressure };

struct Blocks {
  std::string name;
  int cells;                // of the upper block along x and y
  double shift_x, shift_y;  // m, of the upper block
  double pushed;            // m
  Compared compared = Compared::linear;

  bool large() const { return compared != Compared::linear; }
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

// The faces of cells of one region in planes x_axis = at, as CalculiX numbers them.
struct Plane {
  std::size_t axis;
  double at;  // m
};
void print_surface(fmt::ostream& out, const char* name, const ElasticBody& body, std::int32_t region,
                   const std::vector<Plane>& planes) {
  constexpr int faces[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  out.print("*SURFACE, NAME={}, TYPE=ELEMENT\n", name);
  for (std::size_t e = 0; e < body.tetrahedra.size(); ++e)
    for (int f = 0; body.region[e] == region && f < 4; ++f) {
      const auto lies_in = [&](const Plane& plane) {
        return std::ranges::all_of(faces[f], [&](int corner) {
          const auto n = static_cast<std::size_t>(body.tetrahedra[e][static_cast<std::size_t>(corner)]);
          return std::abs(body.nodes[n][plane.axis] - plane.at) < 1e-9;
        });
      };
      if (std::ranges::any_of(planes, lies_in)) out.print("{},S{}\n", e + 1, f + 1);
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

CalculixPair by_calculix(const std::filesystem::path& folder, const std::array<Block, 2>& blocks, const Blocks& pair) {
  const bool large = pair.large();
  const double shift[2] = {pair.shift_x, pair.shift_y}, pushed = pair.pushed;
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
    std::vector<Plane> upper = {{2, kLowerHeight}};
    if (large)
      for (std::size_t axis : {0, 1})
        for (const double side : {-kUpperSide / 2, kUpperSide / 2}) upper.push_back({axis, shift[axis] + side});
    print_surface(out, "UPPER", both, 0, upper);
    print_surface(out, "LOWER", both, 1, {{2, kLowerHeight}});
    out.print(
        "*SURFACE INTERACTION, NAME=APART\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{:g}\n"
        "*CONTACT PAIR, INTERACTION=APART, TYPE=SURFACE TO SURFACE\n{}\n"
        "*STEP, {}INC=200\n*STATIC\n0.5,1.,1e-5,1.\n*BOUNDARY\nTOP,1,2\nTOP,3,3,{:.12e}\n"
        "*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=1000\nRF\n*END STEP\n",
        kSprings, large ? "LOWER, UPPER" : "UPPER, LOWER", large ? "NLGEOM, " : "", -pushed);
  }
  const auto asked = studies::Clock::now();
  accuracy::run_calculix(folder, "blocks");
  CalculixPair answer = read_pair(folder / "blocks.dat", both.nodes.size());
  answer.seconds = studies::seconds_since(asked);
  std::filesystem::remove_all(folder);
  return answer;
}

// ---- both --------------------------------------------------------------------------------------------------------------

// Pa: the mean Cauchy stress -sigma_zz of the cells of a block in the layer on the contact, below or above the middle half of the upper block's
// face, by CalculiX's law (neo_hookean_words()).
double pressure(const Block& block, double young, std::span<const Vector3d> u, const Blocks& pair) {
  const double shear = young / (2 * (1 + kPoisson)), bulk = young / (3 * (1 - 2 * kPoisson));
  double volume = 0, sum = 0;
  for (const auto& t : block.body.tetrahedra) {
    Eigen::Matrix3d rest, now;
    Vector3d middle = Vector3d::Zero();
    const auto at = [&](int i) { return Vector3d(block.body.nodes[static_cast<std::size_t>(t[i])].data()); };
    const auto moved = [&](int i) -> Vector3d { return at(i) + u[static_cast<std::size_t>(t[i])]; };
    for (int i = 0; i < 4; ++i) middle += at(i) / 4;
    if (std::abs(middle[2] - kLowerHeight) > kLayer || std::abs(middle[0] - pair.shift_x) > kUpperSide / 4 ||
        std::abs(middle[1] - pair.shift_y) > kUpperSide / 4)
      continue;
    for (int i = 0; i < 3; ++i) rest.col(i) = at(i + 1) - at(0), now.col(i) = moved(i + 1) - moved(0);
    const Eigen::Matrix3d f = now * rest.inverse();
    const double j = f.determinant();
    const Eigen::Matrix3d b = std::pow(j, -2.0 / 3) * f * f.transpose();
    const double stress = shear / j * (b(2, 2) - b.trace() / 3) + bulk * (j - 1);
    volume += now.determinant(), sum -= stress * now.determinant();
  }
  return sum / volume;
}

Agreement compare(const Workshop& workshop, const Blocks& pair, const std::filesystem::path& scratch) {
  const std::array<Block, 2> blocks = blocks_of(pair);
  const PressedAnswer ours = by_runtime(workshop, blocks, pair.pushed, pair.large());
  const CalculixPair theirs = by_calculix(scratch, blocks, pair);
  double largest = 0, off = 0;
  std::size_t first = 0, cells = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    if (pair.large() && ours.u[k].size() != blocks[k].body.nodes.size())
      throw OperationError(fmt::format("{}: block {}: expected displacements of all {} nodes, found {}", pair.name, k,
                                       blocks[k].body.nodes.size(), ours.u[k].size()));
    const std::span there = std::span(theirs.u).subspan(first, blocks[k].body.nodes.size());
    if (pair.compared == Compared::large_pressure)
      off = std::max(
          off,
          std::abs(pressure(blocks[k], kYoung[k], ours.u[k], pair) / pressure(blocks[k], kYoung[k], there, pair) - 1));
    // There the upper block's top has come down; here the lower block has come up.
    const Vector3d up = k == 0 ? Vector3d(0, 0, pair.pushed) : Vector3d::Zero();
    for (std::size_t n = 0; !pair.large() && n < ours.u[k].size(); ++n)
      largest = std::max(largest, (there[n] + up).norm()), off = std::max(off, (ours.u[k][n] - there[n] - up).norm());
    first += blocks[k].body.nodes.size(), cells += blocks[k].body.tetrahedra.size();
  }
  if (!pair.large()) off /= largest;
  // What the top does to the upper block is what the upper block does to the lower one.
  if (pair.compared != Compared::large_pressure)
    off = std::max(off, (ours.force - theirs.force).norm() / theirs.force.norm());
  return {first, first, cells, off, 0, ours.seconds, theirs.seconds};
}

}  // namespace

std::vector<CalculixMesh> pressed_block_pairs(const Workshop& workshop) {
  std::vector<CalculixMesh> all;
  for (const Blocks& pair :
       {Blocks{"two blocks in contact, vertices on vertices", 4, 0, 0, 1e-3},
        Blocks{"two blocks in contact, other meshes", 6, 0, 0, 1e-3},
        Blocks{"two blocks in contact, other meshes, shifted", 6, 0.0023, -0.0011, 1e-3},
        Blocks{"two blocks pressed together by a fifth, large strain, vertices on vertices: force", 4, 0, 0, 10e-3,
               Compared::large_force},
        Blocks{"two blocks pressed together by a fifth, large strain, other meshes: force", 6, 0, 0, 10e-3,
               Compared::large_force},
        Blocks{"two blocks pressed together by a fifth, large strain, vertices on vertices: pressure", 4, 0, 0, 10e-3,
               Compared::large_pressure},
        Blocks{"two blocks pressed together by a fifth, large strain, other meshes: pressure", 6, 0, 0, 10e-3,
               Compared::large_pressure}}) {
    CalculixMesh mesh = {pair.name,
                         Element::p1,
                         fmt::format("{:g}", kPoisson),
                         pair.compared == Compared::large_pressure ? kBoundOfPressure : kBound,
                         {}};
    mesh.compare = [=](const std::filesystem::path& scratch) { return compare(workshop, pair, scratch); };
    all.push_back(std::move(mesh));
  }
  return all;
}

}  // namespace palpate::validation
