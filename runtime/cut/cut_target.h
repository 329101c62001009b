// The body that a scene cuts: the linear organ (cut_organ.h), or one under large deformation (cut_large.h). No function is pure, as in body.h.
#pragma once

#include <cstdint>

#include "runtime/base/vec3.h"
#include "runtime/cut/cut_compliance.h"
#include "runtime/cut/cut_triangles.h"

namespace palpate {

class CutRebase;

class CutTarget {
 public:
  const CutCompliance& compliance() const { return compliance_; }
  std::int32_t new_nodes() const { return compliance_.tissue().nodes() - compliance_.tissue().rest_nodes(); }
  // The surface node of a node of CutCompliance: new nodes are those behind all of the bundle's mesh, and the k-th is the k-th surface node in
  // reserve. And back.
  std::int32_t surface_node(std::int32_t node) const {
    const CutTissue& tissue = compliance_.tissue();
    return tissue.is_new(node) ? first_new_ + node - tissue.rest_nodes() : node;
  }
  std::int32_t node_of_mesh(std::int32_t surface_node) const {
    return surface_node < first_new_ ? surface_node : compliance_.tissue().rest_nodes() + surface_node - first_new_;
  }

  // A change of the mesh, with the numbers of CutCompliance. Made until one part cannot be (CutResult). The surface shows it from the next solve on.
  // replayed: of a saved state, before Body::restored() and ContactSolver::restored(), in the order in which the changes came.
  virtual CutResult take_change(const CutChange& /*change*/, bool /*replayed*/) { return {}; }
  // The same of a piece that is to stay where it is.
  virtual CutOutcome ground(std::int32_t /*node*/, double /*stiffness*/, bool /*replayed*/) {
    return CutOutcome::wrong;
  }
  // m, on which a new node's displacement is longer than that of the body, since a host knows the place at rest of the node in reserve.
  virtual void bring(std::int32_t /*surface_node*/, Vec3 /*from_reserve*/) {}
  // After some of these, of which the body then is.
  virtual void end_changes(bool /*replayed*/) {}
  // Changes wait for a body beside the touch.
  virtual bool awaits_body() const { return false; }
  // Counted operations of the last changes, beside those of the compliance.
  virtual double take_operations() { return 0; }
  // What re-bases the compliance; nullptr: nothing does.
  virtual CutRebase* rebase() { return nullptr; }
  // The surface shows the last changes: triangles.changed().
  virtual void show(const CutTriangles& /*triangles*/) {}
  // Back to the uncut body, as a new scene has it, after Body::forget(). replayed: before the changes of a saved state.
  virtual void forget_changes(bool /*replayed*/) {}

 protected:
  ~CutTarget() = default;
  CutCompliance compliance_;
  std::int32_t first_new_ = 0;  // the surface nodes from there on are in reserve
};

}  // namespace palpate
