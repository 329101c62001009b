#include "programs/fit/bundle_family.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <list>
#include <numeric>

#include "formats/errors.h"

namespace palpate::fit {
namespace {

constexpr double kSame = 1e-9;  // relative: moduli that a unit or a division has rounded

using Bundles = std::list<PressedBundle>;

bool same(double a, double b) {
  return std::abs(a - b) <= kSame * std::max(std::abs(a), std::abs(b));
}

// Whether young[a] / young[b] is the same in all bundles.
bool constant_ratio(const Bundles& bundles, std::size_t a, std::size_t b) {
  const auto ratio = [&](const PressedBundle& bundle) { return bundle.regions()[a].young / bundle.regions()[b].young; };
  return std::all_of(bundles.begin(), bundles.end(),
                     [&](const auto& other) { return same(ratio(other), ratio(bundles.front())); });
}

// The regions whose moduli vary against the first one's, all by the same factor. Errors: InputError where the
// regions fall into more than two groups.
std::vector<bool> varied_moduli(const Bundles& bundles, std::size_t regions) {
  std::vector<bool> varied(regions);
  std::size_t other = regions;
  for (std::size_t r = 0; r < regions; ++r) {
    varied[r] = !constant_ratio(bundles, r, 0);
    if (!varied[r]) continue;
    if (other == regions) other = r;
    if (!constant_ratio(bundles, r, other))
      throw InputError(
          fmt::format("{}: expected bundles in which the stiffness of two groups of regions has another ratio, found "
                      "three that vary "
                      "(\"{}\", \"{}\" and \"{}\")",
                      bundles.front().file().string(), bundles.front().regions()[0].name,
                      bundles.front().regions()[other].name, bundles.front().regions()[r].name));
  }
  return varied;
}

std::vector<bool> varied_poisson(const Bundles& bundles, std::size_t regions) {
  std::vector<bool> varied(regions);
  for (const PressedBundle& bundle : bundles)
    for (std::size_t r = 0; r < regions; ++r)
      if (!same(bundle.regions()[r].poisson, bundles.front().regions()[r].poisson)) varied[r] = true;
  return varied;
}

double poisson_of(const PressedBundle& bundle, const std::vector<bool>& varied) {
  double value = NAN;
  for (std::size_t r = 0; r < varied.size(); ++r) {
    if (!varied[r]) continue;
    if (std::isnan(value)) value = bundle.regions()[r].poisson;
    if (!same(value, bundle.regions()[r].poisson))
      throw InputError(
          fmt::format("{}: expected one Poisson's ratio in all regions where the bundles differ, found {} and {}",
                      bundle.file().string(), value, bundle.regions()[r].poisson));
  }
  return value;
}

void find_parameter(const Bundles& bundles, BundleFamily& family) {
  const std::size_t regions = family.regions.size();
  const std::vector<bool> moduli = varied_moduli(bundles, regions), poisson = varied_poisson(bundles, regions);
  const auto any = [](const std::vector<bool>& which) {
    return std::find(which.begin(), which.end(), true) != which.end();
  };
  const auto names = [&] {
    std::string text;
    for (const PressedBundle& bundle : bundles) text += (text.empty() ? "" : ", ") + bundle.file().string();
    return text;
  };
  if (any(moduli) == any(poisson))
    throw InputError(
        fmt::format("{}: expected bundles that differ in one thing, Poisson's ratio or the ratio of two regions' "
                    "moduli, found {}; a common "
                    "factor of all moduli needs one bundle alone",
                    names(), any(moduli) ? "some that differ in both" : "the same materials"));
  family.parameter = any(moduli) ? Parameter::ratio : Parameter::poisson;
  family.varied = any(moduli) ? moduli : poisson;
  const auto varied = static_cast<std::size_t>(std::find(moduli.begin(), moduli.end(), true) - moduli.begin());
  for (const PressedBundle& bundle : bundles) {
    const auto& r = bundle.regions();
    family.values.push_back(any(moduli) ? std::log(r[varied].young / r[0].young) : poisson_of(bundle, poisson));
  }
}

void sort_by_parameter(BundleFamily& family) {
  std::vector<std::size_t> order(family.values.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return family.values[a] < family.values[b]; });
  const auto sorted = [&](const auto& list) {
    auto copy = list;
    for (std::size_t b = 0; b < order.size(); ++b) copy[b] = list[order[b]];
    return copy;
  };
  family.files = sorted(family.files), family.values = sorted(family.values),
  family.stiffness = sorted(family.stiffness);
  for (std::size_t b = 1; b < order.size(); ++b)
    if (family.values[b] - family.values[b - 1] <= kSame)
      throw InputError(
          fmt::format("{}: expected another material than that of {}, found the same; leave one of them out",
                      family.files[b], family.files[b - 1]));
}

}  // namespace

BundleFamily press_bundles(const std::vector<std::filesystem::path>& files, const Measurements& measurements,
                           Press press) {
  Bundles bundles;
  for (const auto& file : files) {
    bundles.emplace_back(file);
    bundles.back().expect_same_body(bundles.front());
  }
  BundleFamily family;
  family.regions = bundles.front().regions();
  family.soft_supports = !bundles.front().soft_supports().empty();
  family.varied.resize(family.regions.size());
  if (bundles.size() > 1)
    find_parameter(bundles, family);
  else
    family.values = {0};
  for (PressedBundle& bundle : bundles) {
    std::vector<double> stiffness = bundle.stiffness(measurements.spots, press, measurements.file);
    for (double& value : stiffness) value /= bundle.regions()[0].young;
    family.stiffness.push_back(std::move(stiffness));
    family.files.push_back(bundle.file().string());
    family.warnings.insert(family.warnings.end(), bundle.warnings().begin(), bundle.warnings().end());
    family.plate_height = bundle.plate_height();
    if (const double limit = bundle.linear_limit(); limit > 0)
      family.linear_limit = family.linear_limit > 0 ? std::min(family.linear_limit, limit) : limit;
  }
  sort_by_parameter(family);
  return family;
}

}  // namespace palpate::fit
