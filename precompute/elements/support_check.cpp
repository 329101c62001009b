#include "precompute/elements/support_check.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "formats/errors.h"

namespace palpate {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Row = Eigen::Matrix<double, 1, 6>;

// A motion counts as free where the supports hold it less than kWeakest times as well as the motion they hold best, or as a
// single held dof would. Such a support multiplies the condition number of K by 1 / kWeakest^2 or more. A held dof counts as 1, a
// spring as the square root of its stiffness over that of its part (Young's modulus times size), at most 1.
constexpr double kWeakest = 1e-6;

// Largest number of hinged parts that are checked as one mechanism: its matrix is dense, 6 rows for each part.
constexpr std::size_t kMostHinged = 300;

class Sets {  // union-find
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::int32_t find(std::int32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::int32_t a, std::int32_t b) { parent_[std::max(find(a), find(b))] = std::min(find(a), find(b)); }

 private:
  std::vector<std::int32_t> parent_;
};

struct Part {
  std::vector<std::int32_t> nodes;
  std::size_t tetrahedra = 0;
  std::int32_t region = 0;
  Vector3d center = Vector3d::Zero();
  double size = 0;   // root mean square distance of its nodes from the centre
  double young = 0;  // of its softest region, Pa
};

Vector3d at(const ElasticBody& body, std::int32_t n) {
  return Vector3d(body.nodes[n].data());
}

std::vector<Part> rigid_parts(const ElasticBody& body) {
  struct Face {
    std::array<std::int32_t, 3> nodes;
    std::int32_t tetrahedron;
  };
  std::vector<Face> faces;
  faces.reserve(body.tetrahedra.size() * 4);
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t)
    for (int skip = 0; skip < 4; ++skip) {
      Face face{{}, static_cast<std::int32_t>(t)};
      for (int i = 0, k = 0; i < 4; ++i)
        if (i != skip) face.nodes[k++] = body.tetrahedra[t][i];
      std::sort(face.nodes.begin(), face.nodes.end());
      faces.push_back(face);
    }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.nodes < b.nodes; });
  Sets sets(body.tetrahedra.size());
  for (std::size_t f = 0; f + 1 < faces.size(); ++f)
    if (faces[f].nodes == faces[f + 1].nodes) sets.join(faces[f].tetrahedron, faces[f + 1].tetrahedron);

  std::vector<Part> parts;
  std::vector<std::int32_t> part_of(body.tetrahedra.size(), -1);
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    auto& part = part_of[sets.find(static_cast<std::int32_t>(t))];
    if (part < 0) {
      part = static_cast<std::int32_t>(parts.size());
      parts.emplace_back().region = body.region[t];
      parts.back().young = body.materials[body.region[t]].young;
    }
    parts[part].young = std::min(parts[part].young, body.materials[body.region[t]].young);
    ++parts[part].tetrahedra;
    parts[part].nodes.insert(parts[part].nodes.end(), body.tetrahedra[t].begin(), body.tetrahedra[t].end());
  }
  for (auto& part : parts) {
    std::sort(part.nodes.begin(), part.nodes.end());
    part.nodes.erase(std::unique(part.nodes.begin(), part.nodes.end()), part.nodes.end());
    for (const auto n : part.nodes) part.center += at(body, n) / static_cast<double>(part.nodes.size());
    for (const auto n : part.nodes) part.size += (at(body, n) - part.center).squaredNorm();
    part.size = std::sqrt(part.size / static_cast<double>(part.nodes.size()));
  }
  return parts;
}

// Row that gives component d of the displacement t + w x (p - center) from the rigid motion (t, size * w). The factor
// size gives translations and rotations the same unit.
Row motion_of(const Part& part, const Vector3d& p, int d) {
  const Vector3d arm = (p - part.center) / part.size;
  Row row = Row::Zero();
  row[d] = 1;
  row[3 + (d + 1) % 3] = arm[(d + 2) % 3];
  row[3 + (d + 2) % 3] = -arm[(d + 1) % 3];
  return row;
}

// The same for the component along an axis.
Row motion_along(const Part& part, const Vector3d& p, const Vector3d& axis) {
  return axis[0] * motion_of(part, p, 0) + axis[1] * motion_of(part, p, 1) + axis[2] * motion_of(part, p, 2);
}

// A soft support of one node along one axis; node b: the other end, or Spring::kWorld.
struct Tie {
  std::int32_t a, b;
  Vector3d axis;
  double stiffness;  // N/m
};

std::vector<Tie> soft_ties(const ElasticBody& body) {
  std::vector<Tie> ties;
  for (const auto& foundation : body.foundations)
    for (const auto triangle : foundation.triangles) {
      const auto& t = body.triangles[triangle];
      const Vector3d edge = at(body, t[1]) - at(body, t[0]);
      const Vector3d cross = edge.cross(at(body, t[2]) - at(body, t[0]));
      const double share = cross.norm() / 6;
      const Vector3d normal = cross.normalized(), along = edge.normalized();
      for (const auto n : t) {
        if (foundation.normal > 0) ties.push_back({n, Spring::kWorld, normal, share * foundation.normal});
        if (foundation.tangential == 0) continue;
        ties.push_back({n, Spring::kWorld, along, share * foundation.tangential});
        ties.push_back({n, Spring::kWorld, normal.cross(along), share * foundation.tangential});
      }
    }
  for (const auto& set : body.springs)
    for (const auto& spring : set.springs) {
      const Vector3d axis(spring.axis.data());
      if (!axis.isZero(0)) ties.push_back({spring.a, spring.b, axis, spring.stiffness});
      for (int d = 0; axis.isZero(0) && d < 3; ++d)
        ties.push_back({spring.a, spring.b, Vector3d::Unit(d), spring.stiffness});
    }
  return ties;
}

// The motions that the rows leave free, as columns. gram: the sum of row^T row.
MatrixXd null_space(const MatrixXd& gram) {
  Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
  const double largest = solver.eigenvalues().tail<1>()[0];
  Eigen::Index free = 0;
  while (free < gram.rows() && solver.eigenvalues()[free] <= kWeakest * kWeakest * std::max(largest, 1.0)) ++free;
  return largest > 0 ? MatrixXd(solver.eigenvectors().leftCols(free)) : MatrixXd::Identity(gram.rows(), gram.rows());
}

// Left singular vectors of a matrix and its singular values, descending, from the eigenvalues of m m^T: good to 1e-8 of
// the largest, which is enough to tell motions from none, and much faster to compile than Eigen's singular value
// decomposition.
struct Singular {
  MatrixXd vectors;
  Eigen::VectorXd values;
};
Singular left_singular(const MatrixXd& m) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(m * m.transpose());
  return {solver.eigenvectors().rowwise().reverse(), solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt()};
}

std::string components(const Vector3d& v) {
  const auto clean = [&v](double x) { return std::abs(x) < 1e-9 * v.cwiseAbs().maxCoeff() ? 0.0 : x; };
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", clean(v[0]), clean(v[1]), clean(v[2]));
}

// "(10, 20, 30) mm".
std::string position(const Vector3d& metres, const LengthUnit& unit) {
  return components(metres / unit.metres) + ' ' + unit.name;
}

// Turned so that its largest component is positive: the sign of an eigenvector is arbitrary, the message must not be. Three
// digits are a twentieth of a degree.
std::string direction(const Vector3d& v) {
  Eigen::Index most;
  v.cwiseAbs().maxCoeff(&most);
  const Vector3d unit = (v[most] < 0 ? -v : v).normalized();
  const auto digits = [](double x) { return std::abs(x) < 5e-4 ? 0.0 : x; };
  return fmt::format("({:.3g}, {:.3g}, {:.3g})", digits(unit[0]), digits(unit[1]), digits(unit[2]));
}

// "can still slide along (1, 0, 0) and rotate about the axis through (...) m along (0, 1, 0)".
std::string describe(const Part& part, const MatrixXd& motions, const LengthUnit& unit) {
  if (motions.cols() == 6) return "nothing holds it at all";
  // Motions without rotation are translations. The basis of the others is turned so that their rotations are
  // orthogonal.
  const MatrixXd rotations = motions.bottomRows(3);
  const Singular turn = left_singular(rotations.transpose());
  const MatrixXd basis = motions * turn.vectors;
  std::vector<std::string> ways;
  std::vector<Vector3d> slides;
  for (Eigen::Index m = 0; m < basis.cols(); ++m) {
    const bool turns = m < 3 && turn.values[m] > 1e-4;
    if (!turns) slides.push_back(basis.col(m).head<3>().normalized());
  }
  for (const auto& slide : slides) ways.push_back("slide along " + direction(slide));
  for (Eigen::Index m = 0; m < basis.cols() && m < 3; ++m) {
    if (turn.values[m] <= 1e-4) continue;
    const Vector3d w = basis.col(m).tail<3>() / part.size;
    Vector3d t = basis.col(m).head<3>();
    for (const auto& slide : slides) t -= slide * slide.dot(t);
    const Vector3d through = part.center + w.cross(t) / w.squaredNorm();
    const bool screws = std::abs(w.dot(t)) > 1e-4 * w.norm() * t.norm() && t.norm() > 1e-6 * part.size * w.norm();
    ways.push_back(fmt::format("{} about the axis through {} along {}", screws ? "screw" : "rotate",
                               position(through, unit), direction(w)));
  }
  std::string text = "it can still ";
  for (std::size_t i = 0; i < ways.size(); ++i) text += (i == 0 ? "" : i + 1 == ways.size() ? " and " : ", ") + ways[i];
  return text;
}

class SupportCheck {
 public:
  SupportCheck(const ElasticBody& body, const std::filesystem::path& file, const LengthUnit& unit)
      : body_(body),
        file_(file),
        unit_(unit),
        parts_(rigid_parts(body)),
        grounded_(parts_.size(), 0),
        ties_(soft_ties(body)),
        part_of_node_(body.nodes.size(), -1),
        ties_of_(parts_.size()) {
    std::vector<std::vector<std::int32_t>> parts_at(body.nodes.size());
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (const auto n : parts_[p].nodes) parts_at[n].push_back(static_cast<std::int32_t>(p));
    for (std::size_t n = 0; n < parts_at.size(); ++n)
      if (parts_at[n].size() > 1) hinges_[static_cast<std::int32_t>(n)] = parts_at[n];
    // A tie at a hinge belongs to one of its parts; the hinge passes it on to the others.
    for (std::size_t n = 0; n < parts_at.size(); ++n)
      if (!parts_at[n].empty()) part_of_node_[n] = parts_at[n].front();
    for (std::size_t t = 0; t < ties_.size(); ++t) {
      const auto a = part_of_node_[ties_[t].a], b = end_part(ties_[t]);
      ties_of_[a].push_back(t);
      if (b >= 0 && b != a) ties_of_[b].push_back(t);
    }
  }

  void run() {
    // Parts that their own supports hold, or hinges on parts that are already known to be held.
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t p = 0; p < parts_.size(); ++p)
        if (!grounded_[p] && null_space(gram_of(p)).cols() == 0) grounded_[p] = changed = true;
    }
    for (const auto& group : loose_groups()) check_mechanism(group);
  }

 private:
  Eigen::Matrix<double, 6, 6> gram_of(std::size_t p) const {
    Eigen::Matrix<double, 6, 6> gram = Eigen::Matrix<double, 6, 6>::Zero();
    for (const auto n : parts_[p].nodes) {
      const auto hinge = hinges_.find(n);
      bool held_by_neighbour = false;
      if (hinge != hinges_.end())
        for (const auto other : hinge->second) held_by_neighbour = held_by_neighbour || grounded_[other];
      for (int d = 0; d < 3; ++d) {
        if (!body_.fixed[n][d] && !held_by_neighbour) continue;
        const Row row = motion_of(parts_[p], at(body_, n), d);
        gram += row.transpose() * row;
      }
    }
    for (const auto t : ties_of_[p]) {
      const Tie& tie = ties_[t];
      const bool from = part_of_node_[tie.a] == static_cast<std::int32_t>(p),
                 to = end_part(tie) == static_cast<std::int32_t>(p);
      const auto other = from ? end_part(tie) : part_of_node_[tie.a];
      if (!(from && to) && other >= 0 && !grounded_[other]) continue;
      Row row = Row::Zero();
      if (from) row += motion_along(parts_[p], at(body_, tie.a), tie.axis);
      if (to) row -= motion_along(parts_[p], at(body_, tie.b), tie.axis);
      gram += weight_of(tie) * (row.transpose() * row);
    }
    return gram;
  }

  // The part at the other end of a tie; -1: the world.
  std::int32_t end_part(const Tie& tie) const { return tie.b == Spring::kWorld ? -1 : part_of_node_[tie.b]; }

  // The square of what the tie counts beside a held dof.
  double weight_of(const Tie& tie) const {
    const Part& part = parts_[part_of_node_[tie.a]];
    return std::min(1.0, tie.stiffness / (part.young * part.size));
  }

  // The parts that are not known to be held, in groups that are hinged or tied together.
  std::vector<std::vector<std::int32_t>> loose_groups() const {
    Sets sets(parts_.size());
    for (const auto& [node, parts] : hinges_) {
      std::int32_t before = -1;
      for (const auto p : parts) {
        if (grounded_[p]) continue;
        if (before >= 0) sets.join(before, p);
        before = p;
      }
    }
    for (const Tie& tie : ties_) {
      const auto a = part_of_node_[tie.a], b = end_part(tie);
      if (b >= 0 && !grounded_[a] && !grounded_[b]) sets.join(a, b);
    }
    std::map<std::int32_t, std::vector<std::int32_t>> groups;
    for (std::size_t p = 0; p < parts_.size(); ++p)
      if (!grounded_[p]) groups[sets.find(static_cast<std::int32_t>(p))].push_back(static_cast<std::int32_t>(p));
    std::vector<std::vector<std::int32_t>> result;
    for (auto& [first, group] : groups) result.push_back(std::move(group));
    return result;
  }

  void check_mechanism(const std::vector<std::int32_t>& group) const {
    if (group.size() > kMostHinged)
      throw InputError(fmt::format(
          "{}: {} parts of the mesh hang together by single vertices, edges or springs only, too many to check "
          "whether they are held; fix more of each, or mesh without such hinges",
          file_.string(), group.size()));
    const auto size = static_cast<Eigen::Index>(6 * group.size());
    MatrixXd gram = MatrixXd::Zero(size, size);
    std::map<std::int32_t, Eigen::Index> first_row;  // of each part of the group
    for (std::size_t i = 0; i < group.size(); ++i) {
      first_row[group[i]] = static_cast<Eigen::Index>(6 * i);
      gram.block<6, 6>(static_cast<Eigen::Index>(6 * i), static_cast<Eigen::Index>(6 * i)) += gram_of(group[i]);
    }
    // Two parts that share a node must displace it alike.
    for (const auto& [node, parts] : hinges_)
      for (std::size_t i = 0; i < parts.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
          if (!first_row.count(parts[i]) || !first_row.count(parts[j])) continue;
          const auto a = first_row[parts[i]], b = first_row[parts[j]];
          for (int d = 0; d < 3; ++d) {
            const Row u = motion_of(parts_[parts[i]], at(body_, node), d);
            const Row v = motion_of(parts_[parts[j]], at(body_, node), d);
            gram.block<6, 6>(a, a) += u.transpose() * u;
            gram.block<6, 6>(b, b) += v.transpose() * v;
            gram.block<6, 6>(a, b) -= u.transpose() * v;
            gram.block<6, 6>(b, a) -= v.transpose() * u;
          }
        }
    for (const Tie& tie : ties_) {
      const auto from = first_row.find(part_of_node_[tie.a]), to = first_row.find(end_part(tie));
      if (from == first_row.end() || to == first_row.end() || from == to) continue;
      const Row u = motion_along(parts_[from->first], at(body_, tie.a), tie.axis);
      const Row v = motion_along(parts_[to->first], at(body_, tie.b), tie.axis);
      const double weight = weight_of(tie);
      gram.block<6, 6>(from->second, from->second) += weight * (u.transpose() * u);
      gram.block<6, 6>(to->second, to->second) += weight * (v.transpose() * v);
      gram.block<6, 6>(from->second, to->second) -= weight * (u.transpose() * v);
      gram.block<6, 6>(to->second, from->second) -= weight * (v.transpose() * u);
    }
    const MatrixXd free = null_space(gram);
    if (free.cols() > 0) refuse(group, free);
  }

  // Names the part that the free motions move most.
  [[noreturn]] void refuse(const std::vector<std::int32_t>& group, const MatrixXd& free) const {
    std::size_t worst = 0;
    double most = 0;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const double motion = free.middleRows(static_cast<Eigen::Index>(6 * i), 6).norm();
      if (motion > most * (1 + 1e-9)) most = motion, worst = i;
    }
    const Part& part = parts_[group[worst]];
    const Singular own = left_singular(free.middleRows(static_cast<Eigen::Index>(6 * worst), 6));
    Eigen::Index count = 0;
    while (count < own.values.size() && own.values[count] > 1e-6) ++count;
    const MatrixXd motions = own.vectors.leftCols(count);
    std::size_t held = 0;
    for (const auto n : part.nodes)
      for (int d = 0; d < 3; ++d) held += body_.fixed[n][d];
    std::string hinge;
    std::size_t shared = 0;
    for (const auto n : part.nodes) shared += hinges_.count(n);
    if (shared > 0) hinge = fmt::format(", hinged to others at {} nodes", shared);
    if (!ties_of_[group[worst]].empty())
      hinge += fmt::format(", {} springs of [[foundation]] and [[spring]]", ties_of_[group[worst]].size());
    throw InputError(fmt::format(
        "{}: the organ is not held: part {} of {} ({} tetrahedra of region \"{}\" around {}, {} fixed degrees of "
        "freedom{}) has {} of its 6 rigid motions left: {}; fix more nodes, or support it by a [[foundation]] "
        "or [[spring]]",
        file_.string(), group[worst] + 1, parts_.size(), part.tetrahedra, body_.region_names[part.region],
        position(part.center, unit_), held, hinge, count, describe(part, motions, unit_)));
  }

  const ElasticBody& body_;
  const std::filesystem::path& file_;
  const LengthUnit& unit_;
  std::vector<Part> parts_;
  std::vector<char> grounded_;
  std::map<std::int32_t, std::vector<std::int32_t>> hinges_;  // nodes that several parts share, and those parts
  std::vector<Tie> ties_;
  std::vector<std::int32_t> part_of_node_;         // one of its parts
  std::vector<std::vector<std::size_t>> ties_of_;  // of each part
};

}  // namespace

void check_support(const ElasticBody& body, const std::filesystem::path& boundary_file, const LengthUnit& unit) {
  SupportCheck(body, boundary_file, unit).run();
}

}  // namespace palpate
