#include "precompute/elements/place_motions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/csv_lines.h"
#include "formats/errors.h"
#include "precompute/elements/place_supports.h"

namespace palpate {
namespace {

using Point = std::array<double, 3>;
using Nodes = std::vector<std::int32_t>;
using Kind = BoundaryConfig::Motion::Kind;

double distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

Point unit(const Point& a) {
  const double size = std::hypot(a[0], a[1], a[2]);
  return {a[0] / size, a[1] / size, a[2] / size};
}

// For each node 1 where something holds it that can itself move: a held dof, a foundation, a spring to the world.
std::vector<char> supported_nodes(const ElasticBody& body) {
  std::vector<char> supported(body.nodes.size(), 0);
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    supported[n] = body.fixed[n][0] || body.fixed[n][1] || body.fixed[n][2];
  for (const auto& foundation : body.foundations)
    for (const auto triangle : foundation.triangles)
      for (const auto n : body.triangles[triangle]) supported[n] = 1;
  for (const auto& set : body.springs)
    for (const auto& spring : set.springs)
      if (spring.b == Spring::kWorld) supported[spring.a] = 1;
  return supported;
}

struct FieldRow {
  Point at, way;  // m
};

std::vector<FieldRow> read_field(const std::filesystem::path& file, double metres) {
  CsvLines lines(file, "the columns x,y,z,ux,uy,uz");
  std::vector<FieldRow> rows;
  for (bool named = false; lines.next(); named = true) {
    if (!named) {
      std::string names = lines.text();
      std::erase(names, ' ');
      if (names != "x,y,z,ux,uy,uz") lines.refuse("the names of the columns, x,y,z,ux,uy,uz");
      continue;
    }
    auto row = csv_numbers<6>(lines.text());
    if (!row) lines.refuse("six finite numbers x,y,z,ux,uy,uz");
    for (double& x : *row) x *= metres;
    const auto& [x, y, z, ux, uy, uz] = *row;
    rows.push_back({{x, y, z}, {ux, uy, uz}});
  }
  if (rows.empty()) throw InputError(fmt::format("{}: expected rows of x,y,z,ux,uy,uz, found none", file.string()));
  return rows;
}

std::vector<double> longest_edges(const ElasticBody& body) {
  std::vector<double> longest(body.nodes.size(), 0.0);
  for (const auto& t : body.tetrahedra)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) longest[t[i]] = std::max(longest[t[i]], distance(body.nodes[t[i]], body.nodes[t[j]]));
  return longest;
}

// Each node that moves takes the row nearest to it.
std::vector<Point> field_at(const std::vector<FieldRow>& rows, const std::vector<char>& moves, const ElasticBody& body,
                            const BoundaryConfig::Motion& config) {
  const std::vector<double> longest = longest_edges(body);
  std::vector<Point> way(body.nodes.size(), Point{});
  for (std::size_t n = 0; n < way.size(); ++n) {
    if (!moves[n]) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const FieldRow& row : rows)
      if (const double away = distance(row.at, body.nodes[n]); away < least) least = away, way[n] = row.way;
    if (least > longest[n])
      throw InputError(fmt::format(
          "{}: expected a row near every support that moves, found none within {:.3g} m of the node at "
          "({:.4g}, {:.4g}, {:.4g}) m (its longest edge; the nearest row is {:.3g} m away); add rows, check "
          "their unit (mesh_unit), or select fewer supports",
          config.file.path.string(), longest[n], body.nodes[n][0], body.nodes[n][1], body.nodes[n][2], least));
  }
  return way;
}

class MotionPlacer {
 public:
  MotionPlacer(double metres, const std::filesystem::path& file, ElasticBody& body)
      : metres_(metres), file_(file), body_(body), supported_(supported_nodes(body)) {}

  // nodes: the selected ones; for all nothing.
  void place(const BoundaryConfig::Motion& config, const Nodes* nodes) {
    switch (config.kind) {
      case Kind::piston:
      case Kind::rotation:
        place_rigid(config, nodes);
        break;
      case Kind::field: {
        Motion motion{config.name, formats::MotionKind::field};
        motion.moves = moving(config, nodes);
        motion.way = field_at(read_field(config.file.path, metres_), motion.moves, body_, config);
        body_.motions.push_back(std::move(motion));
        break;
      }
      case Kind::pressure: {
        Motion motion{config.name, formats::MotionKind::pressure};
        motion.triangles = triangles_on(body_, *nodes);
        if (motion.triangles.empty())
          refuse(config, fmt::format("expected nodes that are the three corners of a triangle of the surface, found "
                                     "none among the {} selected nodes; select a larger piece of the surface",
                                     nodes->size()));
        body_.motions.push_back(std::move(motion));
        break;
      }
      case Kind::gravity:
        place_gravity(config);
        break;
    }
  }

  [[noreturn]] void refuse(const BoundaryConfig::Motion& config, const std::string& what) const {
    throw InputError(fmt::format("{}:{}: [[motion]] \"{}\": {}", file_.string(), config.line, config.name, what));
  }

 private:
  void place_rigid(const BoundaryConfig::Motion& config, const Nodes* nodes) {
    const bool turns = config.kind == Kind::rotation;
    Motion motion{config.name, turns ? formats::MotionKind::rotation : formats::MotionKind::piston, unit(config.axis)};
    for (int d = 0; d < 3; ++d) motion.point[d] = config.point[d] * metres_;
    motion.moves = moving(config, nodes);
    body_.motions.push_back(std::move(motion));
  }

  void place_gravity(const BoundaryConfig::Motion& config) {
    for (std::size_t r = 0; r < body_.materials.size(); ++r)
      if (body_.materials[r].density <= 0)
        refuse(config,
               fmt::format("gravity needs the density of every region, [[region]] \"{}\" of organ.toml has none",
                           body_.region_names[r]));
    for (std::size_t d = 0; d < 3; ++d) {
      Motion motion{config.name + ' ' + "xyz"[d], formats::MotionKind::gravity};
      motion.axis[d] = 1;
      body_.motions.push_back(std::move(motion));
    }
  }

  std::vector<char> moving(const BoundaryConfig::Motion& config, const Nodes* nodes) const {
    std::vector<char> moves = supported_;
    if (nodes) {
      moves.assign(supported_.size(), 0);
      for (const auto n : *nodes) moves[n] = supported_[n];
    }
    if (std::find(moves.begin(), moves.end(), 1) == moves.end())
      refuse(config, fmt::format("expected supports that move (held nodes, foundations, springs to the world), found "
                                 "none {}; select others",
                                 nodes ? fmt::format("among the {} selected nodes", nodes->size()) : "in this file"));
    return moves;
  }

  double metres_;
  const std::filesystem::path& file_;
  ElasticBody& body_;
  std::vector<char> supported_;
};

}  // namespace

void place_motions(const BoundaryConfig& boundary, double metres, const std::filesystem::path& file,
                   const std::function<Nodes(const std::vector<Selector>&)>& select, ElasticBody& body) {
  MotionPlacer placer(metres, file, body);
  for (const auto& config : boundary.motions) {
    const Nodes nodes = config.select.empty() ? Nodes{} : select(config.select);
    placer.place(config, config.select.empty() ? nullptr : &nodes);
    for (std::size_t i = 0; i < body.motions.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (body.motions[i].name == body.motions[j].name)
          placer.refuse(config,
                        fmt::format("expected names that differ, where gravity makes \"NAME x\", \"NAME y\" and "
                                    "\"NAME z\", found \"{}\" twice; choose another name",
                                    body.motions[i].name));
    if (body.motions.size() > static_cast<std::size_t>(formats::kMostMotions))
      placer.refuse(config, fmt::format("expected at most {} motions, where gravity counts as three, found {}",
                                        formats::kMostMotions, body.motions.size()));
  }
}

}  // namespace palpate
