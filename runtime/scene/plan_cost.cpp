// Predicts the work of a pass. Bytes and flops follow from the shapes of the data. The factors of the scalar steps were measured
// once; docs/speed.md compares predicted and measured costs.
#include <algorithm>

#include "runtime/base/host_struct.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

class PassWork {
 public:
  PassWork(const palpate_scene& scene, const palpate_step_load& load) : scene_(scene), load_(load) {}

  palpate_pass_work of(Pass pass) const {
    const double points = load_.points, tools = load_.tools, contacts = load_.contacts, nodes = load_.nodes,
                 grips = load_.grips;
    switch (pass) {
      case Pass::input:
        return {0, 0, 42 + 0.5 * points + 1.3 * grips};
      case Pass::collision:
        return {0, 0, 15 + 8 * points + deformed_tests()};
      case Pass::rows:
        return {0, 0, 10 + 10 * contacts + 5 * nodes + 1700 * patches()};
      case Pass::contact:
        return in_touch() ? of_body(*in_touch()) : solve();
      case Pass::force:
        return {
            0, 0,
            10 + (scene_.def.force == PALPATE_FORCE_RESPONSE ? 2.0 * scene_.touch.response.ratio_count() * tools : 0)};
      case Pass::output:
        return {0, 0, 25 + 3 * tools + nodes};
      case Pass::superposition:
        if (in_touch()) return {24.0 * scene_.shape.nodes, 0, 50};
        return superposition();
      case Pass::deform:
        return of_body(*scene_.body());
      case Pass::radial:
        return {0, 0,
                (2.5 + 0.25 * scene_.shape.radial.ratio_count()) * scene_.shape.nodes * std::min(tools, contacts)};
      case Pass::positions:
        return {36.0 * scene_.shape.nodes, 3.0 * scene_.shape.nodes, 100};
      case Pass::count:
        break;
    }
    return {};
  }

 private:
  // While the contacts move, each asks for the surface without it in each step. Where they are few, their changes seldom use up its
  // distance to that surface.
  double deformed_tests() const {
    constexpr std::int32_t few = 5;
    if (scene_.def.collision != PALPATE_COLLISION_DEFORMED) return 0;
    return load_.contacts * (load_.contacts > few ? 200 + 6.0 * load_.nodes : 20);
  }

  // Contacts of tool points: each of them may press a disc.
  double patches() const {
    return scene_.def.contact == PALPATE_CONTACT_PATCH ? std::max(0, load_.contacts - load_.grips) : 0;
  }

  const EffectInScene* in_touch() const { return scene_.body_in_touch(); }
  palpate_pass_work of_body(const EffectInScene& body) const { return body.effect->body->predict(scene_, load_); }

  palpate_pass_work solve() const {
    const double rows = load_.rows, nodes = load_.nodes, contacts = load_.contacts;
    // Two triangular solves and a residual; a product with the matrix per sweep, three per
    // step of Newton's method and, in every second one, a new factor. A contact that slips has new rows, which join the
    // factor again.
    const double newton = load_.newton_steps, of_two_discs = static_cast<double>(kOfTwoDiscs);
    return {0, 2 * rows * rows * (3 + load_.sweeps + 3 * newton) + newton * rows * rows * rows / 3,
            60 + 60 * contacts + 20 * nodes + 120 * contacts * (load_.sweeps + 2 * newton) +
                (100 + 40 * nodes + 5 * nodes * nodes + of_two_discs * patches()) * load_.slips};
  }

  palpate_pass_work superposition() const {
    const Tensors& tensors = scene_.tensors;
    const DisplacementRows& interior = scene_.shape.interior;
    const double inside = interior.numbers ? 9.0 * interior.nodes : 0;
    const double outside = tensors.compliance ? static_cast<double>(tensors.compliance->numbers_per_column())
                                              : 9.0 * tensors.surface_nodes;
    const double bytes = static_cast<double>(element_bytes_of_surface()) * outside +
                         static_cast<double>(formats::element_bytes(interior.type)) * inside;
    return {bytes * load_.nodes, 2 * (outside + inside) * load_.nodes, 150 + 20.0 * load_.nodes};
  }
  std::uint64_t element_bytes_of_surface() const {
    return formats::element_bytes(scene_.tensors.compliance ? scene_.tensors.compliance->type()
                                                            : scene_.tensors.surface.type);
  }

  const palpate_scene& scene_;
  const palpate_step_load& load_;
};

}  // namespace
}  // namespace palpate

palpate_pass_work palpate_predict_pass(const palpate_scene* scene, int32_t pass, const palpate_step_load* load) {
  palpate_step_load sent = {};
  if (!scene || !palpate::read_host_struct(load, &sent)) return palpate_pass_work{};
  for (std::int32_t id = 0; id < palpate::kPasses; ++id)
    if (scene->watch.index_in_plan[id] == pass)
      return palpate::PassWork(*scene, sent).of(static_cast<palpate::Pass>(id));
  for (std::int32_t e = 0; e < scene->effect_count; ++e)
    if (scene->watch.index_in_plan[palpate::kPasses + e] == pass)
      return scene->effects[e].effect->pass.predict(*scene, sent);
  return palpate_pass_work{};
}
