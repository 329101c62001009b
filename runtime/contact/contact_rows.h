// Places and nodes that are held -> the step's contact rows, by the scene's contact model.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_patch.h"
#include "runtime/contact/contact_set.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// One contact as a tool asks for it.
struct ContactWish {
  std::int32_t tool = 0, point = 0;
  Vec3 displacement;       // m, of the place from rest; axes that are not imposed are zero
  std::uint32_t axes = 7;  // of x, y, z
  double radius = 0;       // m, of the disc; 0: a point
  ContactLaw law = ContactLaw::sticking;
  double friction = 0;
  Vec3 outward, tangent;  // unit, across one another; for a patch, and for any law but sticking
};

class ContactRows {
 public:
  // What the rows are made from; borrowed. rest and patch may be nullptr where no effect has them.
  struct Source {
    palpate_contact_model model;
    const std::int32_t* column_of_node;  // [Ns] or -1
    const std::int32_t* triangles;       // [F][3]
    const double* rest;                  // [Ns][3] m
    ContactPatch* patch;
  };
  bool create(SceneMemory& memory, const Source& source, std::int32_t entry_capacity, std::int32_t block_capacity);

  // A new step: no contacts. Those of the last one are remembered for their patches.
  void begin();
  void forget() { last_.block_count = 0; }

  // Both return step flags; *made tells whether there is a contact. Wishes come in ascending order of tool and point.
  std::uint32_t hold_node(const ContactWish& wish, std::int32_t node, bool* made);
  // Vertices without a tensor column give their weight to the others, so that the weights still sum to one and the force
  // stays bounded near a fixed border.
  std::uint32_t hold_place(const ContactWish& wish, const SurfacePlace& place, bool* made);

  const ContactSet& set() const { return set_; }

 private:
  bool create_set(SceneMemory& memory, std::int32_t entries, std::int32_t blocks, ContactSet* set);
  int nearest_vertex(const SurfacePlace& place, const std::int32_t* node, const double* weight, int count) const;
  std::uint32_t hold_patch(const ContactWish& wish, const SurfacePlace& place, bool* made);
  bool repeat_patch(const ContactWish& wish, const SurfacePlace& place);
  bool has_room(std::int32_t blocks, std::int32_t entries) const;
  ContactBlock& add_block(const ContactWish& wish, std::int32_t part);
  void add_entry(const ContactWish& wish, ContactBlock& block, std::int32_t node, double weight);
  void frame_block(const ContactWish& wish, ContactBlock& block);

  Source source_ = {};
  ContactSet set_, last_;
  std::int32_t next_in_last_ = 0;
};

}  // namespace palpate
