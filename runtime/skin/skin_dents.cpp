// The discs of a report, and the vertices around them.
#include <algorithm>

#include "runtime/base/alignment.h"
#include "runtime/skin/skin.h"

namespace palpate {
namespace {

constexpr double kFarthest = 1e6;  // m, as for tools

// Whether the report is of this library and whole, so that its contacts may be read.
bool is_whole(const palpate_contact_report& report, std::int32_t most) {
  return report.struct_bytes == sizeof(palpate_contact_report) && report.contact_bytes == sizeof(palpate_contact) &&
         report.contact_count >= 0 && report.contact_count <= most &&
         report.used_bytes >=
             sizeof(palpate_contact_report) + static_cast<std::size_t>(report.contact_count) * sizeof(palpate_contact);
}

bool is_near(const double* p) {
  return std::fabs(p[0]) <= kFarthest && std::fabs(p[1]) <= kFarthest && std::fabs(p[2]) <= kFarthest;
}

void store_float(Vec3 v, float* out) {
  for (int d = 0; d < 3; ++d) out[d] = static_cast<float>(v[d]);
}

Vec3 load_float(const float* p) {
  return {p[0], p[1], p[2]};
}

}  // namespace

bool Skin::draw_dents(SceneMemory& memory, const SurfaceMeasure* measure, std::int32_t contacts) {
  measure_ = measure, most_contacts_ = contacts;
  if (!dents_.create(memory, contacts)) return false;
  if (!preload_) return true;
  // The bones under no displacement: what the preload alone does to the mesh.
  rest_bones_ = memory.array<Bone>(static_cast<std::size_t>(node_count_));
  if (memory.failed()) return false;
  for (std::int32_t n = 0; n < node_count_; ++n) {
    bones_[n] = Bone{};
    std::copy_n(preload_ + 3 * static_cast<std::size_t>(n), 3, bones_[n].column[3]);
  }
  turn_bones();
  std::copy_n(bones_, node_count_, rest_bones_);
  return true;
}

// A disc reaches 3 b' across its axis, and on a coarse mesh b' is 1.1 node spacings.
double Skin::vertices_near_a_disc() const {
  const double each = static_cast<double>(vertex_count_) / std::max(1, node_count_);
  return std::min<double>(vertex_count_, 34 * each);
}

// False where the contact is damaged. A contact without a disc leaves disc->normal zero.
bool Skin::find_disc(const palpate_contact& contact, DentDisc* disc) const {
  *disc = DentDisc{};
  if (contact.disc_radius == 0) return true;
  if (!(contact.disc_radius > 0 && contact.disc_radius <= 1) || !is_near(contact.tool_point) ||
      !is_near(contact.disc_normal) || !(std::fabs(contact.indentation) <= kFarthest) || contact.triangle < 0 ||
      contact.triangle >= triangle_count_)
    return false;
  SurfacePoint place;
  place.triangle = contact.triangle;
  float weight[3];
  for (int v = 0; v < 3; ++v) {
    if (!(std::fabs(contact.barycentric[v]) <= 2)) return false;
    place.barycentric[v] = contact.barycentric[v], weight[v] = static_cast<float>(contact.barycentric[v]);
  }
  const std::int32_t* node = triangles_[contact.triangle].node;
  Vec3 normal = load3(contact.disc_normal);
  if (rest_bones_) {
    // The normal is that under the preload; bones turn that of the shape as it was meshed. The cofactor's inverse is, but for its
    // length, the transpose of I + H.
    const Bone rest = blended(rest_bones_, node, weight);
    const auto along = [&](int column) { return dot(load_float(rest.column[column]), normal); };
    normal = normal + Vec3{along(0), along(1), along(2)};
  }
  float meshed[3], turned[3];
  store_float(unit_or_zero(normal), meshed);
  turn_normal(blended(bones_, node, weight), meshed, turned);
  disc->centre = load3(contact.tool_point), disc->normal = unit_or_zero(load_float(turned));
  disc->indentation = contact.indentation;
  measure_disc(contact.disc_radius, measure_->spacing(place), measure_->tissue(place).normal_blur, disc);
  return true;
}

void Skin::dent_vertex(std::int32_t v, palpate_skin_out* out) const {
  const std::size_t first = 3 * static_cast<std::size_t>(v);
  const Vertex& vertex = vertices_[v];
  float own_position[3], own_normal[3];
  float* position = out->positions ? out->positions + first : own_position;
  float* normal = out->normals ? out->normals + first : own_normal;
  Bone bone;
  if (!out->positions || !out->normals) bone = blended(bones_, vertex.node, vertex.weight);
  if (!out->positions) place_vertex(v, bone, position);
  if (!dents_.may_reach(position)) return;
  // A mesh without normals faces as the triangle that each vertex is bound to.
  if (!out->normals) turn_normal(bone, normals_ ? normals_ + first : triangles_[triangle_[v]].normal, normal);
  dents_.apply(load_float(normal), position, out->normals ? normal : nullptr);
}

palpate_step_flags Skin::dent(palpate_skin_out* out) {
  out->disc_count = 0;
  const palpate_contact_report& report = *out->report;
  if (!is_aligned(&report) || !is_whole(report, most_contacts_)) return PALPATE_STEP_BAD_INPUT;
  palpate_step_flags flags = 0;
  dents_.begin();
  if (out->disc_normals) out->disc_count = std::min(report.contact_count, out->disc_capacity);
  for (std::int32_t c = 0; c < report.contact_count; ++c) {
    DentDisc disc;
    if (!find_disc(*palpate_report_contact(&report, c), &disc)) {
      flags |= PALPATE_STEP_BAD_INPUT;
      disc = DentDisc{};
    }
    if (c < out->disc_count) store_float(disc.normal, out->disc_normals + 3 * static_cast<std::size_t>(c));
    // Without a dent, or with a normal that is not defined, there is nothing to draw.
    if (disc.indentation != 0 && dot(disc.normal, disc.normal) > 0) dents_.add(disc);
  }
  for (std::int32_t v = 0; dents_.count() > 0 && v < out->vertex_count; ++v) dent_vertex(v, out);
  return flags;
}

}  // namespace palpate
