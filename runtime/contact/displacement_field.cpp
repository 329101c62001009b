#include "runtime/contact/displacement_field.h"

#include <utility>

namespace palpate {
namespace {

Vec3 finite_or_zero(Vec3 u) {
  return is_finite(u) ? u : Vec3{};
}

}  // namespace

bool DisplacementField::create(SceneMemory& memory, std::int32_t node_capacity) {
  exists_ = true;
  for (LoadField* loads : {&now_, &before_}) {
    if (!loads->create(memory, node_capacity)) return false;
    loads->keep(memory);
  }
  return true;
}

void DisplacementField::set(const Tensors& tensors, const ContactConstraints& set, const Vec3* modified, bool solved) {
  std::swap(now_, before_);
  now_.begin(tensors);
  for (std::int32_t e = 0; solved && e < set.node_count; ++e) now_.add(set.nodes[e].column, modified[e]);
}

void DisplacementField::forget() {
  now_.forget(), before_.forget();
}

void DisplacementField::restored(const Tensors& tensors) {
  for (LoadField* loads : {&now_, &before_}) loads->restored(tensors);
}

Vec3 DisplacementField::by_contacts(std::int32_t node) const {
  QueryWork work;
  if (body_) return body_->at_node(node, &work) - body_->moved_at_node(node);
  Vec3 u = now_.at_node(node);
  if (offset_ && offset_->has_given()) u += offset_->given(node);
  u = finite_or_zero(u);
  return added_ ? u + added_->now(node) : u;
}

Vec3 DisplacementField::at_node(std::int32_t node) const {
  QueryWork work;
  return body_ ? body_->at_node(node, &work) : by_contacts(node) + moved_at_node(node);
}

Vec3 DisplacementField::before_at_node(std::int32_t node) const {
  QueryWork work;
  if (body_) return body_->before_at_node(node, &work);
  Vec3 u = finite_or_zero(before_.at_node(node));
  if (added_) u += added_->before(node);
  if (offset_ && offset_->has_given()) u += offset_->given_before(node);
  return offset_ ? u + offset_->before(node) : u;
}

}  // namespace palpate
