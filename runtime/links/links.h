// The links of one organ, between its places or from a place to the world (link.h).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_admission.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/row_source.h"
#include "runtime/links/link.h"
#include "runtime/pose/pose.h"

namespace palpate {

struct TouchState;

// The surface of an organ of which links take hold.
LinkSurface link_surface_of(const palpate_scene_def& def, TouchState& state, std::int32_t triangles);

class Links final : public RowSource {
 public:
  // All borrowed.
  struct Source {
    LinkSurface surface;
    const double* stiffness;  // [S][3][3] N/m, of each column
    const DisplacementField* field;
    const Offset* offset;  // moves the organ beside the contacts
    Pass pass;
  };
  bool create(SceneMemory& memory, const Source& source, std::int32_t capacity);

  // palpate_scene_set_links states the contract.
  palpate_status set(const palpate_link* links, std::int32_t count, palpate_error* error);
  // The links stay, and are as they were when they were given.
  void forget_rest() override;

  std::int32_t begin(TouchStep& step) override;
  void request(TouchStep& step) override;
  // Cost: for each node of a link 9 multiply-adds for each contact node, at distant addresses where it is slack. A slack thread costs a
  // length while a bound on the motion of its ends shows that it stays slack; all of them together then cost rows^2 multiply-adds.
  void end(TouchStep& step) override;
  void tell(TouchStep& step, EventSink& to) override;
  Pass pass() const override { return source_.pass; }

  std::int32_t count() const { return count_; }
  // Finds the ends of a link that a bound has spared, which changes no later step.
  const palpate_link_state* state(std::int32_t link) const;

 private:
  std::uint32_t add_rows(ContactRows& rows, ContactAdmission& admission);
  Operations operations_to_end(std::int32_t contact_nodes) const;
  std::uint32_t read_reactions(const ContactConstraints& set, const Vec3* force, const ContactSolver& solver,
                               bool solved, std::uint64_t step, Operations* work);
  double reach_of(const LinkEnd& end) const;
  void drive(Link& link) const;
  template <class Each>
  void for_threads(const Each& each) const;
  Mat3 compliance_between(const ContactConstraints& set, const ContactSolver& solver, std::int32_t j,
                          std::int32_t k) const;
  bool in_chain(std::int32_t i) const;
  bool may_rest(std::int32_t i) const;
  double longest(const Link& link) const;
  bool walk(const ContactConstraints& set, const ContactSolver& solver, bool solved);

  Source source_ = {};
  Link *links_ = nullptr, *coming_ = nullptr;  // [capacity]
  std::int32_t capacity_ = 0, count_ = 0;
  double path_ = 0;  // sqrt(J), sum of the norms of the field's changes, as far as they were measured
};

}  // namespace palpate
