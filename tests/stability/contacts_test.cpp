// Many contacts, contacts that contradict each other or lie on a fixed border, and huge and tiny displacements.
#include <random>

#include "runtime/contact/contact_solver.h"
#include "tests/runtime/many_discs.h"
#include "tests/runtime/rough_indenter.h"
#include "tests/runtime/sliding_crowd.h"
#include "tests/stability/known_compliance.h"
#include "tests/stability/stability_case.h"
#include "tests/support/packed_bundle.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

SceneDef held_def(std::int32_t contacts, palpate_contact_model model = PALPATE_CONTACT_POINT) {
  SceneDef def = unlimited_def(PALPATE_COLLISION_OFF, model);
  def.max_points = contacts, def.max_contact_nodes = 3 * contacts;
  return def;
}

// The forces at the contact nodes, one column for each node. A tool feels minus their sum.
struct Held : TouchedScene {
  Held(const KnownBox& known, const SceneDef& def, const std::vector<palpate_grip>& grips)
      : TouchedScene(known.box, def) {
    touch(known, grips);
  }
  void touch(const KnownBox& known, const std::vector<palpate_grip>& grips) {
    hold(grips);
    by_column = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(known.box.touchable.size()));
    for (int e = 0; e < contacts->node_count; ++e)
      by_column.segment<3>(3 * contacts.nodes()[e].column) += Vector3d(contacts.nodes()[e].force);
  }
  Vector3d force() { return -TouchedScene::force(); }

  Eigen::VectorXd by_column;
};

// All nodes of this plate are on its surface: 528 touchable ones.
const KnownBox& plate() {
  static const KnownBox known({.cells = {24, 10, 1}, .size = {0.24, 0.1, 0.02}, .interior = false});
  return known;
}
const KnownBox& block() {
  static const KnownBox known({.cells = {4, 4, 4}});
  return known;
}

double off(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return (a - b).lpNorm<Eigen::Infinity>() / b.lpNorm<Eigen::Infinity>();
}

TEST(StabilityContacts, FiveHundredNodesInAnyOrder) {
  StabilityCase attack(
      "The factor is built row by row in the order of the contacts: with hundreds of rows, another order could round "
      "to another force.");
  std::mt19937 random(41);
  for (const int count : {1, 5, 20, 100, 500}) {
    std::vector<std::int32_t> columns = range_of(static_cast<std::int32_t>(plate().box.touchable.size()));
    std::shuffle(columns.begin(), columns.end(), random);
    columns.resize(static_cast<std::size_t>(count));
    const auto in_this_order = [&] {
      std::vector<palpate_grip> grips;
      for (const std::int32_t c : columns) {
        const std::int32_t node = plate().box.touchable[c];
        grips.push_back(grip_at_node(node, wave(node)));
      }
      return Held(plate(), held_def(500), grips);
    };
    const double bound = rounding_of(plate().compliance(columns));
    Held first = in_this_order();
    EXPECT_EQ(first.flags, 0u);
    double worst = 0;
    for (int order = 0; order < quick_or_long(2, 20); ++order) {
      std::shuffle(columns.begin(), columns.end(), random);
      worst = std::max(worst, off(in_this_order().by_column, first.by_column));
    }
    attack.hold("force of " + std::to_string(count) + " nodes, relative change with their order", worst, bound,
                "rounding: rows x 1.1e-16 x the condition of W");
  }
}

TEST(StabilityContacts, EverySurfaceNodeAtOnce) {
  StabilityCase attack(
      "With every node of the surface held, the contact system has its largest size and condition; sums in single "
      "precision could miss the targets.");
  std::vector<palpate_grip> grips;
  const auto all = range_of(static_cast<std::int32_t>(plate().box.touchable.size()));
  for (const std::int32_t node : plate().box.touchable) grips.push_back(grip_at_node(node, wave(node)));
  Held held(plate(), held_def(static_cast<std::int32_t>(grips.size())), grips);
  EXPECT_EQ(held.flags, 0u);
  const auto u = held.shape();
  double missed = 0, terms = 0;
  for (int e = 0; e < held.contacts->node_count; ++e) {
    const palpate_contact_node& node = held.contacts.nodes()[e];
    for (int i = 0; i < 3; ++i) missed = std::max(missed, std::abs(u[3 * node.node + i] - wave(node.node)[i]));
    terms += Vector3d(node.modified_displacement).lpNorm<1>();
  }
  // No entry of a column is larger than 1.5 here; 2^-24 of each product, and as much for each of the running sums.
  attack.hold("a target missed by the shape, m", missed, 2 * 6e-8 * 1.5 * terms,
              "single precision: 2^-24 of every product and of the sum of their sizes");
  attack.hold("a target missed in the contact system, m", held.contacts->residual_displacement,
              0.002 * rounding_of(plate().compliance(all)), "rounding of 1584 rows");
}

// Whether W, scaled to a diagonal of one, plus shift I is positive definite.
bool is_definite(const Eigen::MatrixXd& w, double shift) {
  const Eigen::VectorXd d = w.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = d.asDiagonal() * w * d.asDiagonal();
  scaled.diagonal().array() += shift;
  return Eigen::LLT<Eigen::MatrixXd>(scaled).info() == Eigen::Success;
}

TEST(StabilityContacts, HundredsOfNodesInHalfPrecision) {
  StabilityCase attack(
      "Rounded to half precision, the compliance between most nodes of a plate is no longer positive definite: a "
      "factor that continues from a negative pivot gives 1e19 N.");
  const KnownBox half({.cells = {24, 10, 1}, .size = {0.24, 0.1, 0.02}, .interior = false}, store_as_f16);
  const auto all = static_cast<int>(half.box.touchable.size());
  double worst = 0;
  int unsolved = 0, wrong = 0, indefinite = 0;
  for (const int count : {300, 440, 470, 480, 500, all}) {
    std::vector<palpate_grip> grips;
    std::vector<std::int32_t> columns;
    double wanted = 0, reaction = 0;
    for (int c = 0; c < count; ++c) {
      const std::int32_t column = c * all / count, node = half.box.touchable[column];
      columns.push_back(column);
      grips.push_back(grip_at_node(node, wave(node)));
      wanted +=
          (half.block(column, column).diagonal().cwiseSqrt().cwiseInverse().cwiseProduct(wave(node))).squaredNorm();
    }
    Held held(half, held_def(count), grips);
    for (int c = 0; c < count; ++c) {
      const std::int32_t column = c * all / count;
      reaction +=
          (half.block(column, column).diagonal().cwiseSqrt().cwiseProduct(held.by_column.segment<3>(3 * column)))
              .squaredNorm();
    }
    const bool said = held.flags & PALPATE_STEP_UNSOLVED;
    unsolved += said, wrong += said != (reaction == 0);
    indefinite += !said && !is_definite(half.compliance(columns), 3 * ContactFactor::kShift);
    worst = std::max(worst, std::sqrt(reaction / wanted) * ContactFactor::kShift / ContactFactor::kMostSolves);
  }
  EXPECT_TRUE(unsolved > 0 && unsolved < 6);
  attack.hold("reaction over the stated bound", worst, 1, "|D^-1 r| <= kMostSolves / kShift |D d|, or unsolved");
  attack.hold("solved with a compliance that is not definite", indefinite, 0,
              "the shift and what the factor may raise come to 2 kShift; one more for rounding");
  attack.hold("unsolved without a flag, or flagged with a force", wrong, 0, "an unsolved system has no force");
}

TEST(StabilityContacts, AdjacentNodesPulledApartAsTheMeshIsRefined) {
  StabilityCase attack(
      "Two neighbours are held at opposite displacements. As the edge between them shrinks, their rows become equal: "
      "the force could lose its digits, or be lost to regularisation.");
  double missed = 0, worst = 0;
  palpate_step_flags flags = 0;
  for (const int n : {2, 4, 8, quick_or_long(12, 20)}) {
    const KnownBox known({.cells = {n, n, 1}, .size = {0.06, 0.06, 0.015}, .interior = false});
    const auto nearest = [&](double y) {
      std::int32_t best = -1;
      double distance = 1;
      for (const std::int32_t node : known.box.touchable)
        if (const double d = (known.box.node(node) - Vector3d(0.03, y, 0.015)).norm(); d < distance)
          best = node, distance = d;
      return best;
    };
    const std::int32_t pair[2] = {nearest(0.03), nearest(0.03 + 0.06 / n)};
    const std::vector<std::int32_t> columns = {known.column_of(pair[0]), known.column_of(pair[1])};
    const Vector3d d(0, 0.0003, 0.001);
    Eigen::VectorXd target(6);
    target << d, -d;
    Held held(known, held_def(2), {grip_at_node(pair[0], d), grip_at_node(pair[1], -d)});
    flags |= held.flags;
    const auto u = held.shape();
    for (int c = 0; c < 2; ++c)
      for (int i = 0; i < 3; ++i) missed = std::max(missed, std::abs(u[3 * pair[c] + i] - target[3 * c + i]));
    Eigen::VectorXd found(6);
    for (int c = 0; c < 2; ++c) found.segment<3>(3 * c) = held.by_column.segment<3>(3 * columns[c]);
    worst = std::max(worst, off(found, known.compliance(columns).llt().solve(target)));
  }
  attack.hold("a target missed by the shape, m", missed, 2e-6 * 0.001,
              "two columns of single precision, condition below 10");
  attack.hold("forces against a direct solve of W, relative", worst, 1e-9,
              "the refinement ends where the next one would change less than 1e-9");
  attack.hold("flags raised", flags, 0, "the targets can be met, so nothing needs regularisation");
}

// Vertex forces of contact points in one triangle, by the formulas that contact_solver.h states: along an eigenvector of the scaled
// A with eigenvalue e, (1 - (shift / (e + shift))^solves) / e of D d; the same with the soft shift; and the point between the two at
// the limit.
Eigen::VectorXd stated_vertex_forces(const Eigen::MatrixXd& w, const std::vector<Vector3d>& k,
                                     const std::vector<Vector3d>& target, double* reaction_over_bound) {
  const auto rows = 3 * static_cast<Eigen::Index>(k.size());
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(rows, 9);
  Eigen::VectorXd d(rows);
  for (std::size_t p = 0; p < k.size(); ++p) {
    const auto row = 3 * static_cast<Eigen::Index>(p);
    for (int v = 0; v < 3; ++v) h.block<3, 3>(row, 3 * v) = k[p][v] * Eigen::Matrix3d::Identity();
    d.segment<3>(row) = target[p];
  }
  const Eigen::MatrixXd a = h * w * h.transpose();
  const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(scale.asDiagonal() * a * scale.asDiagonal());
  const Eigen::VectorXd scaled = scale.asDiagonal() * d;
  const auto solved = [&](double shift, int solves) {
    Eigen::VectorXd along = modes.eigenvectors().transpose() * scaled;
    for (Eigen::Index m = 0; m < rows; ++m) {
      const double e = std::max(0.0, modes.eigenvalues()[m]), left = std::pow(shift / (e + shift), solves);
      along[m] *= e > 1e-12 ? (1 - left) / e : solves / shift;
    }
    return Eigen::VectorXd(scale.asDiagonal() * (modes.eigenvectors() * along));
  };
  const Eigen::VectorXd alone = d.lpNorm<Eigen::Infinity>() * scale.cwiseAbs2();
  const auto largest_share = [&](const Eigen::VectorXd& r) { return r.cwiseQuotient(alone).lpNorm<Eigen::Infinity>(); };
  const Eigen::VectorXd whole = solved(ContactFactor::kShift, ContactFactor::kMostSolves);
  const Eigen::VectorXd u = w * (h.transpose() * whole);
  const double thrown = u.lpNorm<Eigen::Infinity>() / d.lpNorm<Eigen::Infinity>();
  const double most =
      std::clamp(ReactionLimit::kMostForceNear / thrown, ReactionLimit::kMostForce, ReactionLimit::kMostForceNear);
  Eigen::VectorXd r = whole;
  if (largest_share(whole) > most) {
    Eigen::VectorXd soft = solved(ContactFactor::kSoftShift, ContactFactor::kSoftSolves);
    soft /= std::max(1.0, largest_share(soft) / most);
    double way = 1;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double to = whole[i] - soft[i];
      if (to != 0) way = std::min(way, (most * alone[i] - (to > 0 ? soft[i] : -soft[i])) / std::abs(to));
    }
    r = soft + std::max(0.0, way) * (whole - soft);
  }
  *reaction_over_bound = largest_share(r) / ReactionLimit::kMostForceNear;
  return h.transpose() * r;
}

TEST(StabilityContacts, ManyConflictingPlacesInOneTriangle) {
  StabilityCase attack(
      "A triangle has nine degrees of freedom. Four and more points with different motions give a singular system, "
      "whose unregularised solution is rounding over zero.");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1), share(0, 1);
  const std::int32_t triangle = block().box.far_triangle();
  std::vector<std::int32_t> columns;
  for (const std::int32_t n : block().box.body.triangles[triangle]) columns.push_back(block().column_of(n));
  const Eigen::MatrixXd w = block().compliance(columns);
  double worst = 0, over_bound = 0;
  bool flagged = true;
  for (const int count : {4, 5, 8, 20, 64})
    for (int again = 0; again < quick_or_long(4, 400); ++again) {
      std::vector<Vector3d> k, d;
      std::vector<palpate_grip> grips;
      for (int p = 0; p < count; ++p) {
        const double a = share(random), b = share(random) * (1 - a);
        k.emplace_back(a, b, 1 - a - b), d.emplace_back(0.002 * Vector3d(any(random), any(random), any(random)));
        grips.push_back(grip_at_place(triangle, k.back(), d.back()));
      }
      Held held(block(), held_def(count), grips);
      flagged = flagged && held.flags == PALPATE_STEP_REGULARISED;
      double stated = 0;
      const Eigen::VectorXd expected = stated_vertex_forces(w, k, d, &stated);
      Eigen::VectorXd found(9);
      for (int v = 0; v < 3; ++v) found.segment<3>(3 * v) = held.by_column.segment<3>(3 * columns[v]);
      worst = std::max(worst, off(found, expected)), over_bound = std::max(over_bound, stated);
    }
  attack.hold("vertex forces against the stated formula, relative", worst,
              ContactFactor::kMostSolves * 1.1e-16 * 192 * (192 / 9.0) / ContactFactor::kShift,
              "in each of four solves the rounding of 192 rows times the condition that the shift leaves; 192 rows "
              "with ones on the "
              "diagonal and nine freedoms have an eigenvalue of 192 / 9: 4 x 1.1e-16 x 192 x 21 / 1e-6");
  attack.hold("reaction over the stated bound", over_bound, 1 + 1e-9,
              "kMostForceNear times the force of a row alone; rounding");
  attack.hold("conflicts that raised no flag", flagged ? 0 : 1, 0, "a missed target must raise a flag");

  // Points that move as one but for a millionth: their forces stay below every limit, and are rounding and shift all the same.
  int trusted = 0;
  for (const int count : {4, 8, 20}) {
    std::vector<palpate_grip> grips;
    for (int p = 0; p < count; ++p) {
      const double a = share(random), b = share(random) * (1 - a);
      const Vector3d apart(any(random), any(random), any(random));
      grips.push_back(grip_at_place(triangle, {a, b, 1 - a - b}, Vector3d(0, 0, -0.002) + 2e-9 * apart));
    }
    trusted += Held(block(), held_def(count), grips).flags != PALPATE_STEP_REGULARISED;
  }
  attack.hold("slight conflicts that raised no flag", trusted, 0,
              "forces that the targets do not decide must raise one");
}

TEST(StabilityContacts, OneNodeHeldManyTimes) {
  StabilityCase attack(
      "Many copies of the same rows: the system is singular, and the copies' forces could oppose each other.");
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-0.002, 0.002);
  const std::int32_t node = block().box.touchable[5];
  double worst = 0, elsewhere = 0;
  for (const int count : {2, 3, 10, 64}) {
    Vector3d mean = Vector3d::Zero();
    std::vector<palpate_grip> grips;
    for (int g = 0; g < count; ++g) {
      const Vector3d d(any(random), any(random), any(random));
      mean += d / count;
      grips.push_back(grip_at_node(node, d));
    }
    Held many(block(), held_def(count), grips), once(block(), held_def(1), {grip_at_node(node, mean)});
    worst = std::max(worst, (many.force() - once.force()).norm() / once.force().norm());
    const auto of_many = many.shape(), of_one = once.shape();
    for (std::size_t i = 0; i < of_one.size(); ++i)
      elsewhere = std::max(elsewhere, std::abs(of_many[i] - of_one[i]) / mean.lpNorm<Eigen::Infinity>());
  }
  attack.hold("force against one contact at the mean, relative", worst, 2e-6, "the shift of 1e-6 on the diagonal");
  attack.hold("shape against that of one contact at the mean, relative", elsewhere, 4e-6,
              "the same, and single precision of one column: copies that cancel a millionfold are summed before");
}

TEST(StabilityContacts, ConflictingPairAcrossAnEdgeAndAVertex) {
  StabilityCase attack(
      "Two tools impose opposite motions at points a gap apart. Without a bound the force grows as the reciprocal of "
      "the gap, then becomes rounding, and jumps.");
  const std::int32_t triangle = block().box.far_triangle(6);
  const auto& t = block().box.body.triangles[triangle];
  // The triangle across the edge from vertex 0 to 1, and any other at vertex 0.
  std::int32_t across = -1, around = -1;
  const auto& all = block().box.body.triangles;
  const auto vertex_of = [&](std::int32_t at, std::int32_t n) {
    const auto& nodes = all[at];
    return static_cast<int>(std::find(nodes.begin(), nodes.end(), n) - nodes.begin());
  };
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(all.size()); ++f) {
    if (f == triangle || vertex_of(f, t[0]) > 2) continue;
    if (vertex_of(f, t[1]) < 3) across = f;
    if (vertex_of(f, t[1]) > 2 && vertex_of(f, t[2]) > 2) around = f;
  }
  ASSERT_TRUE(across >= 0 && around >= 0);
  double fall = 0, over = 0;
  for (const bool vertex : {false, true}) {
    double before = 0;
    for (double gap = 1e-1; gap >= 0.9e-12; gap /= 10) {
      const double g = gap / 2;
      Vector3d one = vertex ? Vector3d(1 - g, g / 2, g / 2) : Vector3d(0.5 - g / 2, 0.5 - g / 2, g),
               other = Vector3d::Zero();
      const std::int32_t second = vertex ? around : across;
      other.setConstant(vertex ? g / 2 : g);
      other[vertex_of(second, t[0])] = vertex ? 1 - g : 0.5 - g / 2;
      if (!vertex) other[vertex_of(second, t[1])] = 0.5 - g / 2;
      const Vector3d d(0.001, 0, 0);
      const std::vector<palpate_grip> first = {grip_at_place(triangle, one, d)},
                                      opposite = {grip_at_place(second, other, -d)};
      TouchedScene scene(block().box, held_def(2));
      scene.hold(first);
      const double single = scene.force().norm();
      scene.touch({tool_of(first), tool_of(opposite)});
      const double force = scene.force().norm();
      over = std::max(over, std::isfinite(force) ? force / (ReactionLimit::kMostForceNear * std::sqrt(3.0) * 2 * single)
                                                 : INFINITY);
      if (before > 0) fall = std::max(fall, before / force - 1);
      before = force;
      attack.point("conflicting pair", vertex ? "about a vertex" : "across an edge", gap, force);
    }
  }
  attack.hold(
      "relative fall of the force as the gap closes", fall, 0.7,
      "the force grows as the gap closes, up to its limit, which falls from 1,024 / 10 at a gap of 1 / 10 to 64");
  attack.hold("force over the stated bound", over, 1,
              "kMostForceNear times the force of one row alone, three rows; times two for rows that differ");
}

TEST(StabilityContacts, PointsThatSlideAndJump) {
  StabilityCase attack(
      "64 sticking points press, slide over one another and jump. Several hold one triangle at displacements that "
      "contradict each other; met exactly, they throw its vertices metres away.");
  for (const auto contact : {PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT}) {
    SlidingCrowd crowd(contact, PALPATE_LAW_STICKING);
    double over = 0, beyond = 0;
    int silent = 0;
    for (int s = 0; s < quick_or_long(500, 20000); ++s) {
      crowd.step();
      if (crowd.largest_target == 0) continue;
      over = std::max(over, crowd.largest_displacement / crowd.largest_target);
      const double force = crowd.largest_force / (ReactionLimit::kMostForceNear * crowd.largest_target);
      beyond = std::max(beyond, force);
      silent += crowd.largest_displacement > 8 * crowd.largest_target &&
                !(crowd.flags & (PALPATE_STEP_REGULARISED | PALPATE_STEP_SOLVE_INEXACT));
    }
    const std::string under = contact == PALPATE_CONTACT_POINT ? ", point" : ", triangle";
    attack.hold("largest displacement over the largest target" + under, over, 16,
                "two points g edges apart: 1/g in displacement, 1/g^2 in force, whose limit is 64; four such pairs");
    attack.hold(
        "force over its limit" + under, beyond, 1 + 2e-6,
        "contact_solver.h: kMostForceNear times the force that a row alone needs for the largest target; the shift");
    attack.hold("shapes thrown far that raised no flag" + under, silent, 0, "REGULARISED, SOLVE_INEXACT");
  }
}

TEST(StabilityContacts, ARoughIndenterThatWedgesItself) {
  StabilityCase attack(
      "Several contacts hold each vertex, each at another displacement, and friction 20 wedges them: a solver of the "
      "contact laws that stops early gives forces that pull, exceed friction or have no limit, and says nothing.");
  const TouchedBox box({.cells = {3, 6, 5}});
  // Where the solver ends depends on the limit of work, and so do the forces of a step that misses a law.
  double wedged = 0, slid = 0, pulled = 0;
  for (const std::int64_t most : {200'000, 300'000, 500'000, 700'000, 1'000'000}) {
    RoughIndenter indenter(box, {0.06, 0.024, 0.021}, 20, PALPATE_LAW_COULOMB, PALPATE_CONTACT_TRIANGLE, most);
    for (int s = 0; s < RoughIndenter::kSteps; ++s) {
      indenter.step(s);
      const RoughIndenter::Forces forces = indenter.forces();
      wedged = std::max(wedged, forces.over_limit);
      pulled = std::max({pulled, forces.pull, forces.beyond_friction});
    }
    slid = std::max(slid, indenter.farthest_slide);
  }
  attack.hold("force over its limit, friction 20, 200,000 to 1,000,000 operations", wedged, 1 + 2e-6,
              "contact_solver.h: kMostForce times the force that a row alone needs for the largest target; the shift");
  attack.hold("pull, or tangential force beyond friction, with them, N", pulled, 1e-12,
              "Signorini and Coulomb; rounding");
  attack.hold("way of an anchor over a face in a step, beyond its distance from the tool there, m", slid, 1e-12,
              "where a law is missed, it goes no farther than the tool is; rounding");
  for (const double friction : {0.3, 20.0}) {
    RoughIndenter indenter(box, {0.06, 0.024, 0.021}, friction);
    double trusted = 0, pull = 0, excess = 0, work = 0;
    int decided = 0, missed = 0;
    for (int s = 0; s < RoughIndenter::kSteps; ++s) {
      const palpate_step_flags flags = indenter.step(s);
      Contacts& contacts = indenter.contacts;
      decided += contacts->sweeps > 0, missed += (flags & PALPATE_STEP_SOLVE_INEXACT) != 0;
      if (flags == 0) trusted = std::max(trusted, contacts->residual_displacement);
      const RoughIndenter::Forces forces = indenter.forces();
      pull = std::max(pull, forces.pull), excess = std::max(excess, forces.beyond_friction);
      for (int e = 0; e < contacts->node_count; ++e)
        work = Vector3d(contacts.nodes()[e].force).allFinite() ? work : INFINITY;
    }
    const std::string with = ", friction " + std::to_string(friction).substr(0, friction < 1 ? 3 : 2);
    EXPECT_GT(decided, 200);
    attack.hold("law missed in a step at flag 0, m" + with, trusted, RoughIndenter::trusted(),
                "palpate.h: 1e-6 of the largest u*, and 1e-9 m");
    attack.hold("largest pull of a contact, N" + with, pull, 0, "Signorini: r_n >= 0, whether the solver ends or not");
    attack.hold("tangential force beyond friction, N" + with, excess, 1e-12, "Coulomb, the same; rounding");
    attack.hold("forces that are not finite" + with, work, 0, "every force is bounded");
    attack.hold("share of steps that miss a law" + with, 1.0 * missed / decided, friction < 1 ? 0.03 : 0.5,
                friction < 1 ? "rare: Gauss-Seidel alone misses in 8 %" : "Gauss-Seidel alone misses in 99 %");
  }
}

TEST(StabilityContacts, SixtyFourDiscsUnderTheDefaultLimits) {
  StabilityCase attack(
      "64 points are allowed, and each disc acts on a dozen nodes: a limit of 192 nodes drops 37 of 64 discs and a "
      "third of the force.");
  ManyDiscs all(3000), usual(-1), short_of_nodes(192);
  const double force = all.force().norm();
  attack.hold("discs that are not felt, default limits", ManyDiscs::kDiscs - usual.tool().contact_count, 0,
              "the limits are sized from one another");
  attack.hold("flags of the step, default limits", usual.flags, 0, "none of the limits is short");
  attack.hold("force against that of all nodes, relative", (usual.force() - all.force()).norm() / force, 0.05,
              "palpate.h: a disc on nodes that carry 95 % of it");
  attack.hold("discs that are not felt, 192 nodes", ManyDiscs::kDiscs - short_of_nodes.tool().contact_count, 0,
              "discs are thinned, contacts are not dropped");
  attack.hold("force lost, 192 nodes, relative", 1 - short_of_nodes.force().norm() / force, 0.5,
              "palpate.h: up to a half on a single node");
  attack.hold("a disc thinned without a flag", short_of_nodes.flags == PALPATE_STEP_DISCS_THINNED ? 0 : 1, 0,
              "DISCS_THINNED");
}

TEST(StabilityContacts, OnBesideAndBetweenFixedNodes) {
  StabilityCase attack(
      "A contact point whose weight lies on fixed nodes has no compliance: the force to move it would be infinite.");
  const KnownBox& known = block();
  double worst = 0;
  int broken = 0;
  for (const auto model : kEveryContact)
    for (std::size_t t = 0; t < known.box.body.triangles.size(); ++t) {
      const auto& nodes = known.box.body.triangles[t];
      int fixed = 0, first_fixed = -1;
      for (int v = 0; v < 3; ++v)
        if (known.box.fixed[3 * nodes[v]]) {
          ++fixed;
          if (first_fixed < 0) first_fixed = v;
        }
      if (fixed == 0) continue;
      for (const double away : {0.5, 1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-300, 5e-324, 0.0}) {
        Vector3d k;
        k.setConstant(away / 2), k[first_fixed] = 1 - away;
        const auto grip = grip_at_place(static_cast<std::int32_t>(t), k, {-0.0005, 0.0005, 0.001});
        TouchedScene scene(known.box, with(held_def(60, model), PALPATE_COLLISION_REST));
        const palpate_step_flags flags =
            scene.touch({grip_tool(&grip, 1, model == PALPATE_CONTACT_PATCH ? 0.004 : 0.0)});
        const Vector3d force(scene.tool().force_raw);
        const bool said = (flags & PALPATE_STEP_NOT_TOUCHABLE) != 0 || scene.contacts->node_count > 0;
        if (!force.allFinite() || !said || (flags & PALPATE_STEP_UNSOLVED)) ++broken;
        if (scene.contacts->node_count == 0) continue;
        std::vector<std::int32_t> columns;
        for (int e = 0; e < scene.contacts->node_count; ++e)
          if (const std::int32_t c = scene.contacts.nodes()[e].column;
              std::find(columns.begin(), columns.end(), c) == columns.end())
            columns.push_back(c);
        const double softest =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(known.compliance(columns)).eigenvalues().minCoeff();
        const double bound = 4 * static_cast<double>(columns.size()) * Vector3d(grip.displacement).norm() / softest;
        worst = std::max(worst, force.norm() / bound);
      }
    }
  attack.hold("force over that of free nodes moved as far", worst, 1,
              "weights that sum to one over n free nodes: |r| <= n |d| / least eigenvalue of W, 4 for alpha of eq. 12");
  attack.hold("steps without an answer or without a flag", broken, 0,
              "a point without compliance gets no force and raises a flag");
}

TEST(StabilityContacts, TargetsOfAPicometreAndOfTenOrgans) {
  StabilityCase attack(
      "The model is linear at any scale. A tolerance in metres in the solve would show as a force that is not "
      "proportional to the target.");
  double worst = 0;
  for (const auto model : {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT}) {
    const auto forces = [&](double size) {
      std::vector<palpate_grip> grips;
      for (int which = 0; which < 6; ++which)
        grips.push_back(grip_at_place(block().box.far_triangle(which), {.2, .3, .5}, size / 0.002 * wave(which)));
      Held held(block(), held_def(6, model), grips);
      return Eigen::VectorXd(held.by_column / size);
    };
    const Eigen::VectorXd expected = forces(0.001);
    for (const double size : {1e-290, 1e-150, 1e-12, 1e-9, 1e-6, 0.06, 0.6, 1e5})
      worst = std::max(worst, off(forces(size), expected));
  }
  attack.hold("force per displacement, relative change from 1e-290 m to 1e5 m", worst, 1e-9,
              "rounding of 54 rows, in three of which rows are near-dependent: 1.1e-16 x 54 / 1e-6");
}

TEST(StabilityContacts, OneOfManyMovesEachTick) {
  StabilityCase attack(
      "If only a few rows leave, the factor is updated and never computed anew: rounding of each update stays in it "
      "while other contacts last.");
  const int nodes = 24, ticks = quick_or_long(20000, 10000000);
  std::mt19937 random(23);
  std::uniform_int_distribution<int> any(0, nodes - 1), beside(0, 2);
  std::vector<std::int32_t> columns;
  for (int c = 0; c < nodes; ++c) columns.push_back(3 * c);
  Held held(block(), held_def(nodes), {});
  std::vector<palpate_grip> grips(nodes);
  const auto touch = [&] {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::int32_t node = block().box.touchable[columns[c]];
      grips[c] = grip_at_node(node, wave(node));
    }
    held.touch(block(), grips);
  };
  for (int tick = 0; tick < ticks; ++tick) {
    const int c = any(random);
    columns[c] = 3 * c + beside(random);
    touch();
  }
  attack.hold("force after " + std::to_string(ticks) + " ticks against a fresh scene's, relative",
              off(held.by_column, Held(block(), held_def(nodes), grips).by_column),
              rounding_of(block().compliance(columns)), "rounding: rows x 1.1e-16 x the condition of W");
}

}  // namespace
}  // namespace palpate::tests
