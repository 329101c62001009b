#include "tests/effects/effects.h"

#include "tests/support/box_corridor.h"
#include "tests/support/box_motions.h"
#include "tests/support/packed_bundle.h"

namespace palpate::tests {
namespace {

// The box and what it answers.
struct Answers {
  // reserve: nodes that wait, and that nothing moves.
  explicit Answers(const DenseBody& body, std::int32_t reserve = 0)
      : dense(body), compliance(dense_compliance(dense)), motions(dense_motions(dense)), sag(compliance.rows()) {
    // A body force along y; its largest displacement is 1 mm.
    for (Eigen::Index n = 0; n < sag.size() / 3; ++n) sag.segment<3>(3 * n) = Eigen::Vector3d(0, -1, 0);
    sag = compliance * sag;
    sag *= 1e-3 / sag.cwiseAbs().maxCoeff();
    motions.field.bottomRows(3 * reserve).setZero();
  }
  DenseBody dense;
  Eigen::MatrixXd compliance;
  DenseMotions motions;
  Eigen::VectorXd sag;
};
const Answers& answers(bool can_be_cut) {
  static const Answers whole(dense_box({})), cut(box_that_can_be_cut(kReserveOfBox), kReserveOfBox);
  return can_be_cut ? cut : whole;
}

void add_sections(BundleParts& parts, Store store, bool can_be_cut) {
  using formats::SectionId;
  const Answers& of = answers(can_be_cut);
  add_motions(parts, of.dense);
  if (can_be_cut)
    add_cut_region(parts, of.dense, kReserveOfBox);
  else
    add_whole_corridor(parts, of.dense);
  add_large_deformation(parts);
  parts.set(SectionId::preload_displacement, {parts.sections.at(SectionId::nodes).shape[0], 3},
            std::vector<double>(of.sag.begin(), of.sag.end()));
  parts.set(SectionId::response_radial, {3}, kRadial.coefficients());
  parts.set(SectionId::response_force, {3}, kForce.coefficients());
  parts.set(SectionId::response_range, {2}, std::vector<double>{kRadial.range, kForce.range});
  if (store == Store::f16) store_as_f16(parts);
  if (store == Store::interior_f16) store_interior_as_f16(parts);
  if (store == Store::blocks) store_in_blocks(parts, {formats::ElementType::f32, 1e-5});
}

void needs_patch(SceneOfEffects& scene, const std::set<Slot>& named) {
  if (!named.count(Slot::contact)) scene.def.contact = PALPATE_CONTACT_PATCH;
}
void needs_deformed(SceneOfEffects& scene, const std::set<Slot>&) {
  scene.def.collision = PALPATE_COLLISION_DEFORMED;
}

}  // namespace

std::vector<double> ResponseOfBox::coefficients() const {
  const double a = range / 2, b = a * a / scale;
  return {a + 1.5 * b, a + 2 * b, 0.5 * b};
}

EffectBody::EffectBody(Store store, bool can_be_cut)
    : compliance(answers(can_be_cut).compliance),
      motions(answers(can_be_cut).motions.field),
      preload(answers(can_be_cut).sag),
      sweep(answers(can_be_cut).motions.sweep),
      touched(answers(can_be_cut).dense, [&](BundleParts& parts) { add_sections(parts, store, can_be_cut); }) {}

const EffectBody& body_of(Store store) {
  static const EffectBody bodies[] = {EffectBody(Store::f32), EffectBody(Store::f16), EffectBody(Store::blocks),
                                      EffectBody(Store::interior_f16)};
  return bodies[static_cast<int>(store)];
}
const EffectBody& body_of(const SceneOfEffects& scene) {
  if (!scene.cut) return body_of(scene.store);
  static const EffectBody f32(Store::f32, true), f16(Store::f16, true), blocks(Store::blocks, true);
  return scene.store == Store::f16 ? f16 : scene.store == Store::blocks ? blocks : f32;
}

const FineHost& effect_fine() {
  static const FineHost host = fine_of(body_of(Store::f32).touched.body, 1, 0);
  return host;
}

const palpate_render_mesh& effect_skin() {
  static const std::vector<float> positions = [] {
    std::vector<float> all;
    const TouchedBody& body = body_of(Store::f32).touched;
    for (std::size_t t = 0; t < body.body.triangles.size(); ++t) {
      const Eigen::Vector3d p = body.place(static_cast<std::int32_t>(t), {0.5, 0.3, 0.2});
      for (int d = 0; d < 3; ++d) all.push_back(static_cast<float>(p[d]));
    }
    return all;
  }();
  static const palpate_render_mesh mesh =
      render_mesh(positions.data(), nullptr, static_cast<std::int32_t>(positions.size() / 3));
  return mesh;
}

const std::vector<Effect>& effects() {
  using S = SceneOfEffects;
  static const std::vector<Effect> list = {
      {"collision deformed", Slot::collision, [](S& s) { s.def.collision = PALPATE_COLLISION_DEFORMED; }},
      {"contact node", Slot::contact, [](S& s) { s.def.contact = PALPATE_CONTACT_NODE; }},
      {"contact triangle", Slot::contact, [](S& s) { s.def.contact = PALPATE_CONTACT_TRIANGLE; }},
      {"contact point", Slot::contact, [](S& s) { s.def.contact = PALPATE_CONTACT_POINT; }},
      {"contact patch", Slot::contact, [](S& s) { s.def.contact = PALPATE_CONTACT_PATCH; }},
      {"law sticking", Slot::law, [](S& s) { s.def.law = PALPATE_LAW_STICKING; }},
      {"law sliding", Slot::law, [](S& s) { s.def.law = PALPATE_LAW_SLIDING; }},
      {"law unilateral", Slot::law, [](S& s) { s.def.law = PALPATE_LAW_UNILATERAL; }},
      {"law coulomb", Slot::law, [](S& s) { s.def.law = PALPATE_LAW_COULOMB; }},
      {"force response (Q)", Slot::own, [](S& s) { s.def.force = PALPATE_FORCE_RESPONSE; }},
      {"radial response (P)", Slot::own, [](S& s) { s.def.radial = PALPATE_RADIAL_RESPONSE; }},
      {"shape volume", Slot::own, [](S& s) { s.def.shape = PALPATE_SHAPE_VOLUME; }},
      {"relaxation", Slot::own,
       [](S& s) {
         s.def.relaxation.terms = 2;
         s.def.relaxation.share[0] = 0.3, s.def.relaxation.time[0] = 0.02;
         s.def.relaxation.share[1] = 0.2, s.def.relaxation.time[1] = 0.3;
       }},
      {"preload", Slot::own, [](S& s) { s.def.preload = PALPATE_PRELOAD_ON; }},
      {"queries", Slot::own, [](S& s) { s.def.queries.queries = PALPATE_QUERIES_ON; }},
      {"report", Slot::own, [](S& s) { s.def.report.report = PALPATE_REPORT_CONTACTS; }},
      {"inside", Slot::own, [](S& s) { s.def.inside.inside = PALPATE_INSIDE_ON, s.def.shape = PALPATE_SHAPE_VOLUME; }},
      {"crossings", Slot::own,
       [](S& s) {
         s.def.crossings.crossings = PALPATE_CROSSINGS_ON;
         s.def.crossings.crossings_calls = 1, s.def.crossings.crossings_operations = 1'000'000'000;
       }},
      {"fine surface", Slot::own, [](S& s) { s.fine = true; }},
      {"skin", Slot::own, [](S& s) { s.skin = true; }},
      {"dent", Slot::own,
       [](S& s) { s.skin = true, s.def.dent.dent = PALPATE_DENT_DISCS, s.def.report.report = PALPATE_REPORT_CONTACTS; },
       needs_patch},
      {"motions", Slot::own, [](S& s) { s.motions = true, s.def.motions.motions = 1; }, needs_deformed},
      {"volumes held", Slot::own, [](S& s) { s.motions = s.holds_volume = true, s.def.motions.motions = 1; },
       needs_deformed},
      {"loads", Slot::own,
       [](S& s) {
         s.loads = true, s.def.loads.count = 2;
         std::copy_n(kPointOfForce, 3, s.def.loads.centre[0]), s.def.loads.radius[0] = 1e-4;
         std::copy_n(kFaceOfTraction, 3, s.def.loads.centre[1]), s.def.loads.radius[1] = 0.05;
       },
       needs_deformed},
      {"force control", Slot::own,
       [](S& s) { s.force_control = true, s.def.force_control.force_control = 1, s.def.max_tools = 5; }},
      {"obstacles", Slot::own, [](S& s) { s.obstacles = true, s.def.obstacles.count = 1; }, needs_deformed},
      {"grasps", Slot::own, [](S& s) { s.grasps = true, s.def.grasps.grasps = 1; }, needs_patch},
      {"links", Slot::own, [](S& s) { s.links = true, s.def.links.max_links = 4; }},
      {"needles", Slot::own,
       [](S& s) { s.needles = true, s.def.needles.needles = 1, s.def.needles.needle_places = 12; }},
      {"organs that touch", Slot::own, [](S& s) { s.touching = true; }, needs_deformed},
      {"links between organs", Slot::own, [](S& s) { s.world_links = true; }},
      {"large", Slot::deformation, [](S& s) { s.def.large.deformation = PALPATE_DEFORMATION_LARGE; }},
      {"large beside", Slot::deformation, [](S& s) { s.def.large.deformation = PALPATE_DEFORMATION_LARGE_BESIDE; }},
      {"large renewed", Slot::deformation, [](S& s) { s.def.large.deformation = PALPATE_DEFORMATION_LARGE_RENEWED; }},
      {"rows f32", Slot::store, [](S& s) { s.store = Store::f32; }},
      {"rows f16", Slot::store, [](S& s) { s.store = Store::f16; }},
      {"blocks", Slot::store, [](S& s) { s.store = Store::blocks; }},
      {"interior f16", Slot::store, [](S& s) { s.store = Store::interior_f16, s.def.shape = PALPATE_SHAPE_VOLUME; }},
      {"cut", Slot::own,
       [](S& s) { s.cut = true, s.def.cut.cut = PALPATE_CUT_ON, s.def.cut.cut_operations = 1'000'000'000; },
       needs_deformed},
  };
  return list;
}

// The rank of the slit is twice that.
constexpr std::int32_t kRebasesAt = 6;

SceneOfEffects scene_with(const std::vector<const Effect*>& all) {
  SceneOfEffects scene;
  // A few constraints: the scene's matrices stay small.
  scene.def.max_tools = 4, scene.def.max_points = 4;
  scene.def.torque_limit = scene.def.torque_slew = INFINITY;
  std::set<Slot> named;
  for (const Effect* effect : all) named.insert(effect->slot);
  for (const Effect* effect : all) {
    effect->apply(scene);
    if (effect->needs) effect->needs(scene, named);
  }
  // A linear organ that is cut goes on from another base in the middle of the slit.
  if (scene.cut && scene.def.large.deformation == PALPATE_DEFORMATION_LINEAR) scene.def.cut.cut_rebase = kRebasesAt;
  return scene;
}

}  // namespace palpate::tests
