// The links of one organ, between its places or from a place to the world (link.h).
#pragma once

#include <cstdint>

#include "runtime/contact/row_source.h"
#include "runtime/links/link_list.h"

namespace palpate {

class Links final : public RowSource, public LinkList {
 public:
  bool create(SceneMemory& memory, const LinkedOrgan& organ, std::int32_t capacity, Pass pass);

  // palpate_scene_set_links states the contract.
  palpate_status set(const palpate_link* links, std::int32_t count, palpate_error* error);
  void forget_rest() override { forget(); }

  std::int32_t begin(TouchStep& step) override;
  void request(TouchStep& step) override;
  // Cost: for each node of a link 9 multiply-adds for each contact node, at distant addresses where it is slack. A slack thread costs a
  // length while a bound on the motion of its ends shows that it stays slack; all of them together then cost rows^2 multiply-adds.
  void end(TouchStep& step) override;
  void tell(TouchStep& step, EventSink& to) override;
  Pass pass() const override { return pass_; }

 private:
  bool add_rows(Link& link, const LinkWish& wish) override;
  bool admits(const Link& first, std::uint32_t* flags) override;
  bool rests(std::int32_t i) const override { return knows_path_ && may_rest(i); }
  Operations operations_to_end(std::int32_t contact_nodes) const;
  bool in_chain(std::int32_t i) const;
  bool may_rest(std::int32_t i) const;
  double longest(const Link& link) const;
  bool walk(const ContactConstraints& set, const ContactSolver& solver);

  LinkedOrgan organ_ = {};
  Pass pass_ = Pass::contact;
  bool knows_path_ = false;  // in this step: what the field has changed since the last one
};

}  // namespace palpate
