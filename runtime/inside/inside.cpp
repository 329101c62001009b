// The C API of the inside.
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "runtime/base/alignment.h"
#include "runtime/base/host_struct.h"
#include "runtime/inside/effect.h"
#include "runtime/inside/inside_field.h"
#include "runtime/pose/pose.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

constexpr double kLargestFloat = 3.4e38;

// nullptr where the scene does not have it.
InsideField* inside_of(const palpate_scene* scene) {
  return scene ? static_cast<InsideField*>(scene->state_of(inside_effect)) : nullptr;
}

void end_pass(const palpate_scene& scene) {
  scene.watch.ended(scene.pass_of(inside_effect));
}

// Whether the shape has all nodes.
bool is_whole(const InsideField& inside, const palpate_shape_out& shape) {
  return shape.node_count >= inside.nodes();
}

bool is_sound(const palpate_inside_out& out) {
  for (const float* array : {out.displacements, out.strains, out.stresses, out.pressures, out.von_mises, out.principal})
    if (!is_aligned(array)) return false;
  return out.capacity >= 0;
}

// Writes a row; a number that single precision does not hold becomes zero. Returns step flags.
palpate_step_flags write(const double* numbers, int count, std::int32_t row, float* array) {
  if (!array) return 0;
  palpate_step_flags flags = 0;
  float* const out = array + static_cast<std::size_t>(count) * static_cast<std::size_t>(row);
  for (int i = 0; i < count; ++i) {
    const bool fits = std::fabs(numbers[i]) <= kLargestFloat;
    out[i] = fits ? static_cast<float>(numbers[i]) : 0;
    if (!fits) flags = PALPATE_STEP_UNSOLVED;
  }
  return flags;
}

palpate_step_flags write_row(const StrainAndStress& value, Vec3 displacement, std::int32_t row,
                             const palpate_inside_out& out) {
  const double u[3] = {displacement.x, displacement.y, displacement.z}, pressure = pressure_of(value.stress);
  palpate_step_flags flags =
      write(u, 3, row, out.displacements) | write(value.strain, kTensorNumbers, row, out.strains) |
      write(value.stress, kTensorNumbers, row, out.stresses) | write(&pressure, 1, row, out.pressures);
  if (out.von_mises) {
    const double von_mises = von_mises_of(value.stress);
    flags |= write(&von_mises, 1, row, out.von_mises);
  }
  if (!out.principal) return flags;
  double principal[3];
  principal_of(value.stress, principal);
  return flags | write(principal, 3, row, out.principal);
}

palpate_step_flags lost(const palpate_scene& scene) {
  return scene.context.bundle.is_lost() ? PALPATE_STEP_BUNDLE_LOST : 0;
}

}  // namespace
}  // namespace palpate

int32_t palpate_scene_locate(const palpate_scene* scene, const double* points, int32_t count, double farthest,
                             palpate_inside_place* places) {
  const palpate::InsideField* const inside = palpate::inside_of(scene);
  if (!inside || !points || !places || count < 0 || !(farthest >= 0)) return -1;
  if (!palpate::is_aligned(points) || !palpate::is_aligned(places)) return -1;
  std::int32_t missing = 0;
  for (std::int32_t i = 0; i < count; ++i) {
    const double* const point = points + 3 * static_cast<std::size_t>(i);
    palpate::TetrahedronTree::Found found;
    if (palpate::is_position(point)) found = inside->locate(palpate::load3(point), farthest);
    palpate_inside_place& place = places[i];
    place = {found.tetrahedron, 0, {}, found.distance};
    for (int a = 0; a < 4; ++a) place.weight[a] = found.weight[a];
    missing += found.tetrahedron < 0;
  }
  return missing;
}

palpate_step_flags palpate_scene_inside(palpate_scene* scene, const palpate_shape_out* shape, palpate_inside_out* out) {
  palpate_shape_out shaped = {};
  palpate_inside_out wanted = {};
  if (out && !palpate::read_host_struct(out, &wanted)) return PALPATE_STEP_BAD_INPUT;
  if (out) out->count = 0;
  palpate::InsideField* const inside = palpate::inside_of(scene);
  if (!inside || !palpate::is_sound(wanted)) return PALPATE_STEP_BAD_INPUT;
  if (!palpate::read_host_struct(shape, &shaped) || !palpate::is_whole(*inside, shaped)) return PALPATE_STEP_BAD_INPUT;
  if (!shaped.displacements || !palpate::is_aligned(shaped.displacements)) return PALPATE_STEP_BAD_INPUT;
  palpate_step_flags flags = inside->compute(shaped.displacements) | palpate::lost(*scene);
  const std::int32_t rows = out ? std::min(inside->nodes(), wanted.capacity) : 0;
  for (std::int32_t n = 0; n < rows; ++n)
    flags |= palpate::write_row(inside->at_node(n), inside->displacement(n), n, wanted);
  if (out) out->count = rows;
  palpate::end_pass(*scene);
  return flags;
}

palpate_step_flags palpate_scene_inside_at(palpate_scene* scene, const palpate_inside_place* places, int32_t count,
                                           palpate_inside_out* out) {
  palpate_inside_out wanted = {};
  if (!palpate::read_host_struct(out, &wanted)) return PALPATE_STEP_BAD_INPUT;
  out->count = 0;
  const palpate::InsideField* const inside = palpate::inside_of(scene);
  if (!inside || !inside->computed() || !palpate::is_sound(wanted)) return PALPATE_STEP_BAD_INPUT;
  if (!places || !palpate::is_aligned(places) || count < 0) return PALPATE_STEP_BAD_INPUT;
  palpate_step_flags flags = palpate::lost(*scene);
  const std::int32_t rows = std::min(count, wanted.capacity);
  for (std::int32_t i = 0; i < rows; ++i) {
    palpate::StrainAndStress value = {};
    palpate::Vec3 displacement;
    if (inside->is_place(places[i]))
      value = inside->at_place(places[i]), displacement = inside->displacement(places[i]);
    else
      flags |= PALPATE_STEP_BAD_INPUT;
    flags |= palpate::write_row(value, displacement, i, wanted);
  }
  out->count = rows;
  palpate::end_pass(*scene);
  return flags;
}

palpate_step_flags palpate_scene_carry(palpate_scene* scene, const palpate_shape_out* shape,
                                       const palpate_inside_place* places, int32_t count, float* positions) {
  palpate_shape_out shaped = {};
  const palpate::InsideField* const inside = palpate::inside_of(scene);
  if (!inside || !palpate::read_host_struct(shape, &shaped)) return PALPATE_STEP_BAD_INPUT;
  if (!palpate::is_whole(*inside, shaped) || !shaped.positions || !places || !positions || count < 0)
    return PALPATE_STEP_BAD_INPUT;
  if (!palpate::is_aligned(shaped.positions) || !palpate::is_aligned(places) || !palpate::is_aligned(positions))
    return PALPATE_STEP_BAD_INPUT;
  palpate_step_flags flags = palpate::lost(*scene);
  for (std::int32_t i = 0; i < count; ++i) {
    palpate::Vec3 sum;
    const bool is_place = inside->is_place(places[i]);
    if (is_place) {
      const std::int32_t* const corner = inside->corners(places[i].tetrahedron);
      for (int a = 0; a < 4; ++a) {
        const float* const x = shaped.positions + 3 * static_cast<std::size_t>(corner[a]);
        for (int d = 0; d < 3; ++d) sum[d] += places[i].weight[a] * static_cast<double>(x[d]);
      }
    }
    if (!is_place || !palpate::is_finite(sum)) flags |= PALPATE_STEP_BAD_INPUT, sum = {};
    const double p[3] = {sum.x, sum.y, sum.z};
    flags |= palpate::write(p, 3, i, positions);
  }
  palpate::end_pass(*scene);
  return flags;
}
