#include "runtime/skin/dent.h"

#include <algorithm>

#include "runtime/base/arcsine.h"

namespace palpate {
namespace {

constexpr double kTwoOverPi = 0.63661977236758134;
// The surface follows a disc fully where it faces it within 60 degrees, and not at all from 78 degrees on, as in ContactPatch.
constexpr double kFacing = 0.2, kFacingFully = 0.5;
// From two to three times b' the rest of M, below 2 % of D, fades out.
constexpr double kFadesFrom = 2, kEnds = 3;
// A disc's rim is rounded outwards over this share of its radius: the closed form's slope is infinite there, and a vertex that the
// rim passes would jump.
constexpr double kRounding = 0.25;
// Largest slope of a dent beside the rim that a normal shows: of a deep dent all else would be black.
constexpr double kSteepest = 2;

// 0 below zero, 1 above one, smooth between.
struct Smooth {
  double value = 0, slope = 0;
};
Smooth smooth(double t) {
  if (!(t > 0)) return {0, 0};
  if (!(t < 1)) return {1, 0};
  return {t * t * (3 - 2 * t), 6 * t * (1 - t)};
}

// P_r and its derivative by rho.
Smooth punch(double r, double rho) {
  if (rho <= r) return {1, 0};
  return {kTwoOverPi * arcsine(r / rho), -kTwoOverPi * r / (rho * std::sqrt((rho - r) * (rho + r)))};
}

// Q: the mean of P_r over r = from .. to.
Smooth smeared_punch(double from, double to, double rho) {
  if (!(to - from > 1e-9)) return punch(0.5 * (from + to), rho);
  if (rho <= from) return {1, 0};
  const double end = std::min(rho, to), width = 1 / (to - from);
  // The integral of asin(r / rho) over r is r asin(r / rho) + sqrt(rho^2 - r^2).
  const double root_from = std::sqrt((rho - from) * (rho + from)), root_end = std::sqrt((rho - end) * (rho + end));
  const double sum = end * arcsine(end / rho) + root_end - from * arcsine(from / rho) - root_from;
  return {width * (to - end + kTwoOverPi * sum), -kTwoOverPi * width * (root_from - root_end) / rho};
}

// m, along the axis: so far from the disc's plane the surface follows the disc fully, and twice as far not at all.
double thickness(const DentDisc& disc) {
  return 2 * disc.wide + std::fabs(disc.indentation);
}

}  // namespace

void measure_disc(double radius, double spacing, double blur, DentDisc* disc) {
  constexpr double smear = 0.75, fade = 0.25;
  disc->radius = radius;
  disc->wide = std::max(radius, kResolvedSpacings * spacing) + blur * spacing;
  disc->share = radius / disc->wide;
  disc->smeared_from = std::max(0.0, disc->wide - smear * spacing);
  disc->fade = std::max(0.5 * radius, fade * spacing);
  disc->reach = std::max(kEnds * disc->wide, radius + disc->fade);
}

DentAt dent_at(const DentDisc& disc, Vec3 position, Vec3 normal) {
  // Places of another side of the organ, or of another lobe beyond, stay.
  const double facing = dot(normal, disc.normal);
  if (!(facing > kFacing)) return {};
  const Vec3 from = position - disc.centre;
  const double height = dot(from, disc.normal);
  const Vec3 across = from - height * disc.normal;
  const double square = dot(across, across);
  if (!(square < disc.reach * disc.reach)) return {};
  const double share = smooth((facing - kFacing) / (kFacingFully - kFacing)).value *
                       smooth(2 - std::fabs(height) / thickness(disc)).value;
  if (!(share > 0)) return {};
  const double rho = std::sqrt(square);

  const Smooth own = smeared_punch(disc.radius, (1 + kRounding) * disc.radius, rho),
               shown = smeared_punch(disc.smeared_from, 2 * disc.wide - disc.smeared_from, rho),
               fades = smooth((rho / disc.wide - kFadesFrom) / (kEnds - kFadesFrom));
  const double d = disc.indentation, window = 1 - fades.value, lacking = own.value - disc.share * shown.value;
  const double missing = d * lacking * window,
               missing_slope = d * ((own.slope - disc.share * shown.slope) * window -
                                    lacking * fades.slope / (disc.wide * (kEnds - kFadesFrom)));
  // What is left between the surface and where the closed form has it: zero height under the disc.
  const Smooth beside = smooth((rho - disc.radius) / disc.fade);
  const double left = height - missing - d * (1 - own.value), hollow = -missing - 0.5 * disc.share * d, bump = 2 * d,
               taken = std::clamp(left, std::min(hollow, bump), std::max(hollow, bump)), flat = 1 - beside.value;
  double slope = missing_slope - taken * beside.slope / disc.fade, along = 0;
  if (taken == left)
    slope += flat * (d * own.slope - missing_slope), along = flat;
  else if (taken == hollow)
    slope -= flat * missing_slope;

  DentAt dent;
  dent.sunk = share * (missing + flat * taken);
  dent.gradient = share * along * disc.normal;
  if (rho > 0) dent.gradient += share * std::clamp(slope, -kSteepest, kSteepest) / rho * across;
  return dent;
}

bool Dents::create(SceneMemory& memory, std::int32_t most) {
  discs_ = memory.array<DentDisc>(static_cast<std::size_t>(most));
  most_ = most;
  return !memory.failed();
}

void Dents::begin() {
  count_ = 0;
  low_ = {INFINITY, INFINITY, INFINITY}, high_ = {-INFINITY, -INFINITY, -INFINITY};
}

void Dents::add(const DentDisc& disc) {
  if (count_ == most_) return;
  discs_[count_++] = disc;
  // The box around a cylinder: the disc reaches so far across its axis, and along it as far as dent_at looks.
  const double along = 2 * thickness(disc);
  for (int i = 0; i < 3; ++i) {
    const double n = disc.normal[i], size = disc.reach * std::sqrt(std::max(0.0, 1 - n * n)) + along * std::fabs(n);
    low_[i] = std::min(low_[i], disc.centre[i] - size);
    high_[i] = std::max(high_[i], disc.centre[i] + size);
  }
}

bool Dents::may_reach(const float* position) const {
  for (int i = 0; i < 3; ++i)
    if (!(position[i] >= low_[i] && position[i] <= high_[i])) return false;
  return true;
}

void Dents::apply(Vec3 facing, float* position, float* normal) const {
  const Vec3 place = {position[0], position[1], position[2]};
  double whole = 0;
  Vec3 move;
  Mat3 gradient;  // of the move, by the place
  for (std::int32_t i = 0; i < count_; ++i) {
    const DentDisc& disc = discs_[i];
    const DentAt dent = dent_at(disc, place, facing);
    const double square = dent.sunk * dent.sunk, weight = square * square;
    if (!(weight > 0)) continue;
    whole += weight;
    move += -weight * dent.sunk * disc.normal;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) gradient.m[r][c] -= weight * disc.normal[r] * dent.gradient[c];
  }
  if (!(whole > 0)) return;
  for (int i = 0; i < 3; ++i) position[i] = static_cast<float>(place[i] + move[i] / whole);
  if (!normal) return;
  // As in Skin: the cofactor of I + gradient, whose columns are cross products of its columns.
  Vec3 column[3];
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) column[c][r] = (r == c) + gradient.m[r][c] / whole;
  const Vec3 turned = unit_or_zero(static_cast<double>(normal[0]) * cross(column[1], column[2]) +
                                   static_cast<double>(normal[1]) * cross(column[2], column[0]) +
                                   static_cast<double>(normal[2]) * cross(column[0], column[1]));
  if (!is_finite(turned) || length(turned) == 0) return;
  for (int i = 0; i < 3; ++i) normal[i] = static_cast<float>(turned[i]);
}

}  // namespace palpate
