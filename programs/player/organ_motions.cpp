#include "programs/player/organ_motions.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "formats/errors.h"
#include "formats/scene_holds.h"
#include "runtime/base/sine.h"

namespace palpate {

double amount_at(const SceneConfig::Motion& motion, double time) {
  if (!motion.sine) return value_at(motion.amounts, time);
  const auto& [mean, amplitude, period] = *motion.sine;
  return mean + amplitude * sine_cosine(2 * std::numbers::pi * std::fmod(time / period, 1.0)).sine;
}

OrganMotions::OrganMotions(const SceneConfig& scene, const palpate_bundle* bundle) : file_(scene.file.string()) {
  if (scene.motions.empty()) return;
  const std::int32_t count = palpate_bundle_describe(bundle).motion_count;
  amounts_.assign(static_cast<std::size_t>(count), 0.0);
  std::vector<palpate_motion_info> known(static_cast<std::size_t>(count));
  std::string names;
  for (std::int32_t m = 0; m < count; ++m) {
    palpate_error error = {};
    if (palpate_bundle_motion(bundle, m, &known[m], sizeof known[m], &error) != PALPATE_OK)
      throw InputError(fmt::format("{}: {}", file_, error.text));
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", known[m].name);
  }
  for (const SceneConfig::Motion& motion : scene.motions) {
    std::size_t index = 0;
    while (index < known.size() && motion.name != known[index].name) ++index;
    if (index == known.size())
      throw InputError(
          fmt::format("{}:{}: [[motion]] \"{}\": expected one of the bundle's motions ({}), found another name; take "
                      "one of these, or add it to the boundary file and make the bundle again",
                      file_, motion.line, motion.name, names.empty() ? "none" : names));
    const palpate_motion_kind kind = known[index].kind;
    const double scale = kind == PALPATE_MOTION_PISTON     ? scene.metres_per_unit
                         : kind == PALPATE_MOTION_ROTATION ? std::numbers::pi / 180
                                                           : 1;
    played_.push_back({motion, index, scale, kind == PALPATE_MOTION_PISTON ? scale : 1});
  }
}

void OrganMotions::set(palpate_scene* scene, double time) {
  if (!any()) return;
  for (const Played& played : played_) amounts_[played.index] = played.scale * amount_at(played.motion, time);
  palpate_error error = {};
  if (palpate_scene_set_motions(scene, amounts_.data(), static_cast<std::int32_t>(amounts_.size()), &error) !=
      PALPATE_OK)
    throw InputError(fmt::format("{}: {}", file_, error.text));
}

}  // namespace palpate
