// The C API of the queries.
#include "runtime/base/alignment.h"
#include "runtime/base/contact_nodes.h"
#include "runtime/base/host_struct.h"
#include "runtime/query/effect.h"
#include "runtime/query/surface_query.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

constexpr double kFarthestCoordinate = 1e6;  // m, as for tools

bool is_place(const double* p) {
  return p && is_aligned(p) && std::fabs(p[0]) <= kFarthestCoordinate && std::fabs(p[1]) <= kFarthestCoordinate &&
         std::fabs(p[2]) <= kFarthestCoordinate;
}

// nullptr where the scene does not have them.
SurfaceQuery* query_of(const palpate_scene* scene) {
  return scene ? static_cast<SurfaceQuery*>(scene->state_of(queries_effect)) : nullptr;
}

// The surface that the queries see from now on.
std::uint32_t see(const palpate_scene& scene, SurfaceQuery& query, const palpate_contacts* contacts) {
  std::uint32_t flags = scene.context.bundle.is_lost() ? PALPATE_STEP_BUNDLE_LOST : 0;
  if (contacts && (!is_aligned(contacts) || !has_layout(*contacts, scene.def.max_contact_nodes, scene.touch.held,
                                                        scene.shape.moved_surface.count))) {
    flags |= PALPATE_STEP_BAD_INPUT;
    contacts = nullptr;
  } else if (contacts && contacts->bundle != scene.context.bundle.index.header.index_checksum) {
    flags |= PALPATE_STEP_OTHER_BUNDLE;
    contacts = nullptr;
  }
  return flags | query.set(contacts);
}

void write_hit(const SurfaceQuery& query, const SurfaceHit& found, palpate_surface_hit* hit) {
  const SurfacePoint on_mesh = query.on_mesh(found.surface_point);
  hit->hit = 1;
  hit->triangle = on_mesh.triangle;
  for (int v = 0; v < 3; ++v) hit->barycentric[v] = on_mesh.barycentric[v];
  store3(found.point, hit->point);
  store3(found.outward, hit->normal);
  hit->distance = found.distance;
}

// Answers a query into the host's struct. find(SurfaceQuery&, SurfaceHit*): false where nothing is met.
template <class Find>
palpate_step_flags answer(palpate_scene* scene, const palpate_contacts* contacts, bool is_sound,
                          palpate_surface_hit* hit, Find find) {
  palpate_surface_hit result = {};
  if (!read_host_struct(hit, &result)) return PALPATE_STEP_BAD_INPUT;
  result = palpate_surface_hit{};
  result.triangle = -1;
  palpate_step_flags flags = PALPATE_STEP_BAD_INPUT;
  if (SurfaceQuery* const query = query_of(scene); query && is_sound) {
    flags = see(*scene, *query, contacts);
    SurfaceHit found;
    if (find(*query, &found)) write_hit(*query, found, &result);
  }
  write_host_struct(result, hit, hit->struct_bytes);
  return flags;
}

}  // namespace
}  // namespace palpate

palpate_step_flags palpate_scene_cast_ray(palpate_scene* scene, const palpate_contacts* contacts, const double* origin,
                                          const double* direction, double longest, palpate_surface_hit* hit) {
  const bool is_sound = palpate::is_place(origin) && direction && palpate::is_aligned(direction) && longest > 0;
  const palpate::Vec3 along = is_sound ? palpate::unit_or_zero(palpate::load3(direction)) : palpate::Vec3{};
  return palpate::answer(scene, contacts, is_sound && palpate::dot(along, along) > 0, hit,
                         [&](palpate::SurfaceQuery& query, palpate::SurfaceHit* found) {
                           return query.cast_ray(palpate::load3(origin), along, longest, found);
                         });
}

palpate_step_flags palpate_scene_closest_point(palpate_scene* scene, const palpate_contacts* contacts,
                                               const double* point, double farthest, palpate_surface_hit* hit) {
  return palpate::answer(scene, contacts, palpate::is_place(point) && farthest > 0, hit,
                         [&](palpate::SurfaceQuery& query, palpate::SurfaceHit* found) {
                           return query.closest(palpate::load3(point), farthest, found);
                         });
}

palpate_step_flags palpate_scene_signed_distance(palpate_scene* scene, const palpate_contacts* contacts,
                                                 const double* point, double* distance) {
  if (!distance || !palpate::is_aligned(distance)) return PALPATE_STEP_BAD_INPUT;
  *distance = INFINITY;
  palpate::SurfaceQuery* const query = palpate::query_of(scene);
  if (!query || !palpate::is_place(point)) return PALPATE_STEP_BAD_INPUT;
  const palpate_step_flags flags = palpate::see(*scene, *query, contacts);
  *distance = query->signed_distance(palpate::load3(point));
  return flags;
}
