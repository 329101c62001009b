#include "studies/played/compared.h"

#include <fmt/format.h>

#include <set>

#include "formats/errors.h"
#include "programs/player/bundle_fields.h"
#include "runtime/large/body_reader.h"
#include "studies/hyperelastic/held_rows.h"

namespace palpate::played {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Far below the errors that are measured.
constexpr double kConverged = 1e-6;

// Whether all held nodes move alike, and by how much, m.
bool move_alike(const HyperelasticBody& body, const VectorXd& u, Vector3d* way) {
  bool any = false, alike = true;
  for (Index n = 0; n < body.node_count; ++n) {
    if (!body.fixed[3 * n] || !body.fixed[3 * n + 1] || !body.fixed[3 * n + 2]) continue;
    if (!any) *way = u.segment<3>(3 * n);
    any = true, alike = alike && (u.segment<3>(3 * n) - *way).norm() < 1e-7;
  }
  if (!any) way->setZero();
  return any && alike;
}

}  // namespace

// The bundle's mesh and laws, as the runtime reads them.
struct Comparison::Body {
  explicit Body(palpate_bundle& bundle, const std::filesystem::path& file)
      : memory(palpate_allocator{}), fields(read_bundle_fields(file)) {
    palpate_error error = {};
    const SectionReader reader(bundle, memory, &error);
    auto* const laws = memory.array<TissueLaw>(reader.counts().regions);
    if (!laws || read_body(reader, "the study", &body, laws) || read_laws(reader, "the study", laws) ||
        read_tetrahedra(reader, &body))
      throw OperationError(fmt::format("{}: {}", file.string(), error.text));
    body.fixed = fields.fixed.data();
    body.support_nodes = fields.support_nodes.data(), body.support_stiffness = fields.support_stiffness.data();
    body.support_count = static_cast<std::int32_t>(fields.support_nodes.size() / 2);
  }
  ~Body() { memory.release_all(); }
  SceneMemory memory;
  BundleFields fields;
  HyperelasticBody body;
};

Comparison::Comparison(const Player& player, const std::filesystem::path& bundle) : player_(player) {
  if (player.scene().def.large.deformation == PALPATE_DEFORMATION_LINEAR ||
      player.scene().def.shape != PALPATE_SHAPE_VOLUME)
    throw InputError(fmt::format("{}: expected deformation = \"large\" and shape = \"volume\" in [effects]",
                                 player.scene().file.string()));
  body_ = std::make_unique<Body>(*player.bundle(), bundle);
  reference_ = std::make_unique<LargeReference>(body_->body);
}

Comparison::~Comparison() = default;

// The reference is then that of the mesh that is left. Returns why there is none; nullptr: there is one.
const char* Comparison::follow_cut(Compared* compared) {
  const palpate_scene& scene = *player_.runtime_scene();
  const palpate_cut_state* const cut = palpate_scene_cut_state(&scene);
  if (!cut || cut->faces + cut->removed == 0) return nullptr;
  compared->split_nodes = cut->nodes, compared->removed = cut->removed;
  if (cut->left > 0) return "the compliance does not have all of the cut yet";
  if (cut->pieces > 1) return "a piece has come off: springs of the scene hold it";
  if (left_ && surface_ == cut->surface) return nullptr;
  left_ = std::make_unique<LeftBody>(body_->body, scene), surface_ = cut->surface;
  reference_ = std::make_unique<LargeReference>(left_->get());
  return nullptr;
}

Compared Comparison::compare(const ShapeRecord& shape) {
  Compared compared;
  compared.time = shape.time, compared.flags = shape.flags | shape.contacts.flags;
  compared.residual = shape.contacts.body_residual, compared.least_volume = shape.contacts.least_volume;
  compared.forces.resize(static_cast<std::size_t>(shape.contacts.tool_count));
  const HeldRows rows = held_rows(*player_.runtime_scene(), shape.node_count);
  VectorXd u = Eigen::Map<const Eigen::VectorXf>(shape.displacements, 3 * Index(shape.node_count)).cast<double>();
  if (const char* const why = follow_cut(&compared)) {
    compared.unsolved = why;
    return compared;
  }
  for (std::int32_t n = 0; left_ && n < shape.node_count; ++n)
    if (!left_->has(n)) u.segment<3>(3 * n).setZero();
  VectorXd exact = u, carried;
  Vector3d supports;
  if (!move_alike(left_ ? left_->get() : body_->body, u, &supports)) {
    compared.unsolved = "the supports do not move alike";
    return compared;
  }
  const VectorXd carried_along = supports.replicate(shape.node_count, 1);
  try {
    // The places of the rows are those beyond what the motions do alone. A body at rest has no inner force to compare a residual with.
    constexpr double at_rest = 1e-6;  // m
    const bool acts = rows.place.size() > 0 || rows.load.any();
    if (acts && (u - carried_along).cwiseAbs().maxCoeff() > at_rest)
      carried = reference_->solve(rows.weights, rows.place + rows.weights * carried_along, &exact, kConverged,
                                  rows.compliance, nullptr, rows.load);
    else
      exact = carried_along;
  } catch (const std::runtime_error& error) {
    compared.unsolved = error.what();
    return compared;
  }
  const Index surface = palpate_bundle_describe(player_.bundle()).surface_node_count;
  double missed = 0, moved = 0;
  for (Index n = 0; n < surface; ++n) {
    if (left_ && !left_->has(n)) continue;
    const double off = (u - exact).segment<3>(3 * n).norm(), way = (exact.segment<3>(3 * n) - supports).norm();
    missed += off * off, moved += way * way;
    compared.worst = std::max(compared.worst, off), compared.moved = std::max(compared.moved, way);
  }
  compared.field = moved > 0 ? std::sqrt(missed / moved) : 0;
  // N, at each node: what Newton's method has less all that the scene reports there. A node that a tool shares with others counts whole.
  VectorXd missing = rows.load;
  if (carried.size() > 0) missing += rows.weights.transpose() * carried;
  for (std::int32_t e = 0; e < shape.contacts.node_count; ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(&shape.contacts, e);
    missing.segment<3>(3 * node.node) -= Vector3d(node.force);
  }
  for (std::size_t t = 0; t < compared.forces.size(); ++t) {
    Vector3d told = Vector3d::Zero(), missed_by = told;
    std::set<std::int32_t> nodes;  // a disc with several rows names a node several times
    for (std::int32_t e = 0; e < shape.contacts.node_count; ++e) {
      const palpate_contact_node& node = *palpate_contacts_node(&shape.contacts, e);
      if (node.source != PALPATE_SOURCE_TOOL || node.index != static_cast<std::int32_t>(t)) continue;
      told += Vector3d(node.force);
      if (nodes.insert(node.node).second) missed_by += missing.segment<3>(3 * node.node);
    }
    compared.forces[t] = {told.norm(), missed_by.norm()};
  }
  return compared;
}

}  // namespace palpate::played
