#include "programs/player/organ_loads.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"
#include "programs/player/tool_places.h"
#include "programs/player/tool_points.h"

namespace palpate {

OrganLoads::OrganLoads(const SceneConfig& scene, const palpate_bundle* bundle)
    : file_(scene.file.string()), loads_(scene.loads) {
  def_.count = static_cast<std::int32_t>(loads_.size());
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    const SurfacePlace place = find_place(loads_[i], bundle, scene.file);
    std::copy(place.point.begin(), place.point.end(), def_.centre[i]);
    def_.radius[i] = loads_[i].radius;
  }
}

void OrganLoads::set(palpate_scene* scene, double time) const {
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    const SceneConfig::Load& load = loads_[i];
    const SceneConfig::Vector vector = position_at(load.vectors, time);
    const auto kind = static_cast<palpate_load_kind>((load.per_area ? PALPATE_LOAD_TRACTION : PALPATE_LOAD_FORCE) +
                                                     (load.in_world ? 1 : 0));
    palpate_error error = {};
    if (palpate_scene_set_load(scene, static_cast<std::int32_t>(i), kind, vector.data(), &error) != PALPATE_OK)
      throw InputError(fmt::format("{}:{}: load \"{}\": {}", file_, load.line, load.name, error.text));
  }
}

}  // namespace palpate
