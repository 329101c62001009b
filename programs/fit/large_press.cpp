#include "programs/fit/large_press.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "formats/averaged_shear.h"
#include "formats/errors.h"
#include "programs/fit/pressed_ball.h"
#include "studies/hyperelastic/large_reference.h"

namespace palpate::fit {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kTolerance = 1e-7;     // of the residual force; the measured forces are known to 1e-3 at best
constexpr double kMostStrain = 0.05;    // between two solutions under a plate
constexpr double kMostShare = 0.2;      // of the indenter's radius, between two solutions
constexpr double kShortest = 1.0 / 64;  // of that, where Newton's method does not converge
constexpr int kMostDepths = 24;         // of one curve that are solved; between them force over depth is interpolated
constexpr double kRounding = 1e-9;

// BLAS and CHOLMOD may use one thread only: curves share the cores, and more threads would change the order of sums. OpenMP asks each thread.
void use_one_thread() {
  for (const char* name : {"openblas_set_num_threads", "bli_thread_set_num_threads", "omp_set_num_threads"})
    if (void* found = dlsym(RTLD_DEFAULT, name)) reinterpret_cast<void (*)(int)>(found)(1);
}

}  // namespace

// A press of one curve: dofs that are held, and either a displacement of held dofs, or rows.
struct LargePress::Way {
  std::vector<std::uint8_t> fixed;
  Vector3d outward = Vector3d::Zero();
  MatrixXd rows, compliance;       // of a disc; compliance times shear modulus, 1/m
  VectorXd way;                    // target over depth
  std::vector<std::int32_t> near;  // a ball: surface nodes that it may touch
  Vector3d place = Vector3d::Zero();
  double radius = 0;  // of a ball, else 0
};

LargePress::LargePress(PressedBundle& bundle, const Measurements& measurements, Press press)
    : data_(measurements),
      press_(press),
      body_(bundle.body()),
      regions_(bundle.regions()),
      file_(bundle.file().string()) {
  if (body_.element == "p2-p0")
    throw InputError(fmt::format("{}: --large: expected a bundle of the elements p1, p1-anp or p1-ang, found {}", file_,
                                 body_.element));
  if (!bundle.soft_supports().empty() && body_.support_nodes->empty())
    throw InputError(
        fmt::format("{}: --large: it has foundations or springs, and what they add to the stiffness is not stored; "
                    "compute it with palpate-precompute --large-deformation",
                    file_));
  shear_ = regions_[0].young / (2 * (1 + regions_[0].poisson));
  for (const double value : *body_.support_stiffness) supports_.push_back(value / shear_);
  double height = 0;
  if (is_plate(press)) {
    axis_ = bundle.plate_axis(sign_), pressed_ = bundle.touchable();
    double low = body_.nodes[axis_], high = low;
    for (std::size_t n = 0; n < std::size_t(body_.surface_count); ++n)
      low = std::min(low, body_.nodes[3 * n + axis_]), high = std::max(high, body_.nodes[3 * n + axis_]);
    height = high - low;
  }
  const auto same = [](const Spot& a, const Spot& b) {
    return a.place == b.place && a.at == b.at && a.radius == b.radius && (a.ball_depth > 0) == (b.ball_depth > 0);
  };
  std::vector<std::vector<double>> depths;
  for (std::size_t r = 0; r < measurements.rows.size(); ++r) {
    const Row& row = measurements.rows[r];
    const Spot& spot = measurements.spots[row.spot];
    auto curve = is_plate(press) ? curves_.begin()
                                 : std::find_if(curves_.begin(), curves_.end(),
                                                [&](const PressedCurve& c) { return same(c.spot, spot); });
    if (curve == curves_.end()) {
      curves_.push_back({spot, {}, is_plate(press) ? height : spot.radius, {}, {}});
      curve = curves_.end() - 1;
    }
    curve->rows.push_back(static_cast<int>(r));
  }
  std::vector<Spot> spots;
  for (PressedCurve& curve : curves_) {
    for (const int r : curve.rows) curve.depths.push_back(measurements.rows[r].depth);
    std::sort(curve.depths.begin(), curve.depths.end());
    const auto last = std::unique(curve.depths.begin(), curve.depths.end(),
                                  [](double a, double b) { return b - a <= kRounding * b; });
    curve.depths.erase(last, curve.depths.end());
    spots.push_back(curve.spot);
    if (curve.depths.back() > curve.scale && is_plate(press))
      throw InputError(fmt::format("{}: expected depths below the height of {}, {:.3g} mm, found {:.3g} mm",
                                   measurements.file.string(), file_, 1e3 * curve.scale, 1e3 * curve.depths.back()));
    if (spots.back().ball_depth > 0 && press != Press::sliding)
      throw InputError(
          fmt::format("{}:{}: a ball is taken as one without friction, but the law is sticking; give "
                      "--law sliding",
                      measurements.file.string(), curve.spot.line));
  }
  if (!is_plate(press)) discs_ = bundle.hold_discs(spots, measurements.file);
  kept_.resize(curves_.size());
}

LargePress::Way LargePress::way_of(const PressedCurve& curve, const HeldDisc* disc) const {
  Way way;
  const auto dofs = 3 * static_cast<Index>(body_.node_count);
  way.fixed.assign(body_.fixed, body_.fixed + dofs);
  if (!disc) {
    way.outward[axis_] = sign_;
    for (const std::int32_t node : pressed_)
      for (int d = 0; d < 3; ++d)
        if (d == axis_ || press_ == Press::sticking_plate) way.fixed[3 * std::size_t(node) + std::size_t(d)] = 1;
    return way;
  }
  way.outward = Vector3d::Map(disc->outward.data());
  if (curve.spot.ball_depth > 0) {
    way.radius = curve.spot.radius;
    way.place = Vector3d::Map(disc->at.data());
    const double reach = way.radius + curve.depths.back();
    for (std::int32_t n = 0; n < body_.surface_count; ++n)
      if ((Vector3d::Map(body_.nodes + 3 * std::size_t(n)) - way.place).norm() < 1.5 * reach) way.near.push_back(n);
    return way;
  }
  const Eigen::Matrix3d local = shear_ * Eigen::Matrix3d::Map(&disc->compliance[0][0]);
  const bool sticking = press_ == Press::sticking;
  const Index count = sticking ? 3 : 1;
  way.rows = MatrixXd::Zero(count, dofs);
  for (std::size_t n = 0; n < disc->nodes.size(); ++n)
    for (int d = 0; d < 3; ++d)
      way.rows(sticking ? d : 0, 3 * Index(disc->nodes[n]) + d) += disc->weights[n] * (sticking ? 1 : way.outward[d]);
  way.compliance = sticking ? MatrixXd(local) : MatrixXd::Constant(1, 1, way.outward.dot(local * way.outward));
  way.way = sticking ? VectorXd(-way.outward) : VectorXd::Constant(1, -1);
  return way;
}

namespace {

// The depths of a curve that are solved.
std::vector<double> solved_depths(const std::vector<double>& depths) {
  if (depths.size() <= static_cast<std::size_t>(kMostDepths)) return depths;
  std::vector<double> result;
  for (int i = 1; i <= kMostDepths; ++i) result.push_back(depths.back() * i / kMostDepths);
  return result;
}

// At each depth: force over depth by parabolas through three neighbours.
double force_at(double depth, const std::vector<double>& depths, const std::vector<double>& forces) {
  const auto count = static_cast<std::ptrdiff_t>(depths.size());
  const auto above = std::lower_bound(depths.begin(), depths.end(), depth) - depths.begin();
  if (above < count && depths[above] == depth) return forces[above];
  const auto first = std::clamp<std::ptrdiff_t>(above - 1, 0, std::max<std::ptrdiff_t>(count - 3, 0));
  double sum = 0;
  for (auto i = first; i < std::min(first + 3, count); ++i) {
    double weight = forces[i] / depths[i];
    for (auto k = first; k < std::min(first + 3, count); ++k)
      if (k != i) weight *= (depth - depths[k]) / (depths[i] - depths[k]);
    sum += weight;
  }
  return depth * sum;
}

}  // namespace

// The bundle's body over the first region's shear modulus.
struct LargePress::Body {
  std::vector<TissueLaw> laws;
  std::unique_ptr<LargeReference> reference;

  Body(const LargePress& press, const Way& way, const LawForm& form,
       const std::shared_ptr<LargeReference::Factor>& factor) {
    const BundleBody& of = press.body_;
    for (const Region& region : press.regions_) {
      const double shear = region.young / (2 * (1 + region.poisson)) / press.shear_;
      LawForm own = form;
      if (own.kind == LawForm::Kind::yeoh) own = LawForm::yeoh(shear * form.constant[0], shear * form.constant[1]);
      laws.push_back({shear, 2 * shear * (1 + region.poisson) / (3 * (1 - 2 * region.poisson)), own});
    }
    HyperelasticBody body;
    body.nodes = of.nodes, body.tetrahedra = of.tetrahedra, body.region = of.region;
    body.fixed = way.fixed.data(), body.laws = laws.data();
    body.node_count = of.node_count, body.tetrahedron_count = of.tetrahedron_count;
    body.region_count = static_cast<std::int32_t>(laws.size());
    body.nodal_dilatation = of.element != "p1";
    body.averaged_shear = of.element == "p1-ang" ? formats::kAveragedShear : 0;
    body.support_nodes = of.support_nodes->data(), body.support_stiffness = press.supports_.data();
    body.support_count = static_cast<std::int32_t>(of.support_nodes->size() / 2);
    reference = std::make_unique<LargeReference>(body, factor);
  }
};

// From a state at the depth `from` on. Returns the force.
double LargePress::press(const Way& way, const Body& body, double depth, double from, State* state) const {
  VectorXd& u = state->u;
  if (way.radius > 0) {
    const Vector3d centre = way.place + (way.radius - depth) * way.outward;
    return PressedBall(body_.nodes, *body.reference, way.radius, way.near, kTolerance, &state->touched)
        .press(centre, -way.outward, depth, &u);
  }
  if (way.rows.rows() > 0)
    return body.reference->solve(way.rows, depth * way.way, &u, kTolerance, way.compliance).dot(way.way);
  if (from > 0) u *= depth / from;
  for (const std::int32_t node : pressed_) u[3 * Index(node) + axis_] = -sign_ * depth;
  body.reference->balance(VectorXd::Zero(u.size()), &u, kTolerance);
  VectorXd force;
  body.reference->energy(u, &force);
  double sum = 0;
  for (const std::int32_t node : pressed_) sum -= sign_ * force[3 * Index(node) + axis_];
  return sum;
}

// The same in steps, which are halved where Newton's method does not converge.
double LargePress::press_on(const Way& way, const PressedCurve& curve, const Body& body, double depth, double from,
                            State* state) const {
  double force = 0;
  const double most = (is_plate(press_) ? kMostStrain : kMostShare) * curve.scale * (1 + kRounding);
  for (double step = std::min(most, depth - from); from < depth;) {
    const double next = std::min(from + step, depth);
    State trial = *state;
    try {
      force = press(way, body, next, from, &trial);
    } catch (const std::runtime_error& error) {
      if ((step /= 2) < kShortest * most)
        throw OperationError(
            fmt::format("{}: no solution at a depth of {:.3g} mm: {}", file_, 1e3 * next, error.what()));
      continue;
    }
    *state = trial, from = next, step = std::min(2 * step, most);
  }
  return force;
}

std::vector<std::vector<double>> LargePress::solve(std::size_t c, const std::vector<LawForm>& forms,
                                                   int* touched) const {
  use_one_thread();
  const PressedCurve& curve = curves_[c];
  const Way way = way_of(curve, discs_.empty() ? nullptr : &discs_[c]);
  const auto factor = LargeReference::shared_factor();
  std::vector<Body> bodies;
  for (const LawForm& form : forms) bodies.emplace_back(*this, way, form, factor);
  const std::vector<double> depths = solved_depths(curve.depths);
  std::vector<std::vector<double>> forces(forms.size());
  std::vector<bool> failed(forms.size());
  std::vector<State> states;
  State state{VectorXd::Zero(bodies.front().reference->dofs()), {}};
  for (std::size_t d = 0; d < depths.size(); ++d) {
    const double depth = depths[d];
    const auto begin_at = [&](std::size_t form, State start) {
      try {
        forces[form].push_back(press(way, bodies[form], depth, depth, &start));
        return std::optional<State>(start);
      } catch (const std::runtime_error&) {
        return std::optional<State>();
      }
    };
    const State before = states.empty() ? state : states.back();
    const double from = d > 0 ? depths[d - 1] : 0;
    const auto found = kept_[c].empty() ? std::nullopt : begin_at(0, kept_[c][d]);
    if (found)
      state = *found;
    else
      forces[0].push_back(press_on(way, curve, bodies[0], depth, from, &state));
    states.push_back(state);
    for (std::size_t form = 1; form < forms.size(); ++form) {
      if (failed[form] || begin_at(form, state)) continue;
      // Where the first form's state is too far, in steps from the depth before.
      try {
        State own = before;
        forces[form].push_back(press_on(way, curve, bodies[form], depth, from, &own));
      } catch (const OperationError&) {
        failed[form] = true;
      }
    }
  }
  for (std::size_t form = 1; form < forms.size(); ++form)
    if (failed[form]) forces[form].clear();
  kept_[c] = std::move(states);
  *touched = static_cast<int>(state.touched.size());
  return forces;
}

std::vector<VectorXd> LargePress::forces(const std::vector<LawForm>& forms) const {
  std::vector<std::vector<std::vector<double>>> found(curves_.size());
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::string failed;
  int fewest = 0;
  const auto work = [&] {
    for (std::size_t c; (c = next++) < curves_.size();) try {
        int touched = 0;
        found[c] = solve(c, forms, &touched);
        const std::lock_guard lock(mutex);
        if (touched > 0) fewest = fewest > 0 ? std::min(fewest, touched) : touched;
      } catch (const std::exception& error) {
        const std::lock_guard lock(mutex);
        failed = error.what();
      }
  };
  const std::size_t threads = std::min<std::size_t>(curves_.size(), std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::thread> pool;
  for (std::size_t t = 1; t < threads; ++t) pool.emplace_back(work);
  work();
  for (std::thread& thread : pool) thread.join();
  if (!failed.empty()) throw OperationError(failed);
  fewest_touched_ = fewest;
  std::vector<VectorXd> result;
  for (std::size_t form = 0; form < forms.size(); ++form) result.push_back(at_rows(found, form));
  return result;
}

// Empty where a curve has no solution of the form.
VectorXd LargePress::at_rows(const std::vector<std::vector<std::vector<double>>>& found, std::size_t form) const {
  VectorXd result(static_cast<Index>(data_.rows.size()));
  for (std::size_t c = 0; c < curves_.size(); ++c) {
    const std::vector<double>& forces = found[c][form];
    if (forces.empty()) return {};
    for (const double force : forces)
      if (!(force > 0) && curves_[c].spot.ball_depth > 0)
        throw InputError(fmt::format(
            "{}:{}: the ball touches no node of the mesh at its shallowest rows, so that it has no force there; "
            "take a finer mesh, or leave these rows out with --least-depth",
            data_.file.string(), curves_[c].spot.line));
    const std::vector<double> depths = solved_depths(curves_[c].depths);
    for (const int r : curves_[c].rows) {
      const double depth = data_.rows[r].depth;
      // A depth that a unit has rounded is the one that was solved.
      const auto same = std::find_if(depths.begin(), depths.end(),
                                     [&](double d) { return std::abs(d - depth) <= kRounding * depth; });
      result[r] = same != depths.end() ? forces[static_cast<std::size_t>(same - depths.begin())]
                                       : force_at(depth, depths, forces);
    }
  }
  return result;
}

}  // namespace palpate::fit
