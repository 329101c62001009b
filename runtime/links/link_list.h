// Links as a host gives them and as steps leave them: those of one organ (links.h), or those between the organs of a world
// (runtime/world/world_links.h). These two add where the rows go and who solves them.
#pragma once

#include <cstdint>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/base/scene_memory.h"
#include "runtime/links/link.h"

namespace palpate {

struct TouchState;

// An organ of which links take hold; borrowed.
struct LinkedOrgan {
  TouchState* touch;
  LinkSurface surface;
  const double* stiffness;  // [S][3][3] N/m, of each column
};
LinkedOrgan linked_organ(const palpate_scene_def& def, TouchState& touch, const double* stiffness);

class LinkList {
 public:
  std::int32_t count() const { return count_; }
  // Finds the ends of a link that a bound has spared, which changes no later step. nullptr behind the last one.
  const palpate_link_state* state(std::int32_t link) const;

 protected:
  // What the two kinds of lists are called where a list is refused.
  struct Names {
    const char *function, *link, *owner;
  };
  // organs: [organ_count], borrowed. in_world: the frame of the links is the world's, not that of their only organ.
  bool create(SceneMemory& memory, const LinkedOrgan* organs, std::int32_t organ_count, bool in_world,
              std::int32_t capacity);
  ~LinkList() = default;

  // Takes the host's list in place of the present one. read(given, &link): the fields of the host's struct `given`, and the organ of each
  // end.
  template <class Given, class Read>
  palpate_status set(const Names& names, const Given* links, std::int32_t count, palpate_error* error,
                     const Read& read) {
    if (const palpate_status status = begin_set(names, count, links == nullptr, error)) return status;
    for (std::int32_t i = 0; i < count; ++i) {
      const auto* const from = reinterpret_cast<const Given*>(reinterpret_cast<const unsigned char*>(links) +
                                                              static_cast<std::size_t>(i) * links->struct_bytes);
      Link& link = coming_[i] = Link{};
      if (const palpate_status status = read(from, &link, error)) return status;
      const bool alike = from->struct_bytes == links->struct_bytes;
      if (const palpate_status status = check_coming(names, i, count, alike, error)) return status;
    }
    end_set(count);
    return succeed(error);
  }
  // The links stay, and are as they were when they were given.
  void forget();

  // A step, in this order. Finds where the ends are now.
  void place_ends();
  // Requests the rows of the threads that act. Returns step flags.
  std::uint32_t request_rows();
  // When the links with rows have their reactions. solved: [organ] whether its contacts have a solution. Returns step flags.
  std::uint32_t read_reactions(const bool* solved, std::uint64_t step);

  // Adds the rows of a link to its organs, with the constraints in its ends. False where there is no room for them all.
  virtual bool add_rows(Link& /*link*/, const LinkWish& /*wish*/) { return false; }
  // Whether a thread may have the rows that it has requested. first: its first part with rows.
  virtual bool admits(const Link& /*first*/, std::uint32_t* /*flags*/) { return true; }
  // Whether a link is slack and is not measured in this step.
  virtual bool rests(std::int32_t) const { return false; }

  TouchState& touch(const LinkEnd& end) const { return *organs_[end.organ].touch; }
  // Where the contacts of the last solve have brought an end.
  // Cost: for each node of the end 9 multiply-adds for each contact node.
  void move_end(Link& link, int e) const;

  const LinkedOrgan* organs_ = nullptr;
  std::int32_t organ_count_ = 0, count_ = 0;
  Link* links_ = nullptr;         // [capacity]
  std::int32_t* seen_ = nullptr;  // [organ_count] divided nodes that the ends have followed
  double path_ = 0;               // sqrt(J), sum of the norms of the field's changes, as far as they were measured

 private:
  palpate_status begin_set(const Names& names, std::int32_t count, bool missing, palpate_error* error) const;
  palpate_status check_coming(const Names& names, std::int32_t i, std::int32_t count, bool alike, palpate_error* error);
  void end_set(std::int32_t count);
  const char* fault_of_coming(std::int32_t i, std::int32_t count, bool alike) const;
  double reach_of(const LinkEnd& end) const;
  void place(Link& link) const;
  void take_back(Link& link) const;
  void follow_surfaces();
  Mat3 compliance_between(const Link& one, const Link& other) const;

  Link* coming_ = nullptr;  // [capacity]
  std::int32_t capacity_ = 0;
  bool in_world_ = false;
};

}  // namespace palpate
