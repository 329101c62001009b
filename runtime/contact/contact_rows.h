// From the surface points and nodes that the tools hold to the step's constraints, by the scene's contact model.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/contact_patch.h"
#include "runtime/contact/easing.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// What a disc that slides almost freely knows from the last step. Its law is along the normal of the disc as it is: that of the surface at rest
// at its mean place, turned as the nodes below it have moved, so that the force along the slide is minus the slope of the stored energy
// (docs/method.md, section 6).
struct DiscSlide {
  Vec3 anchor;             // m, at rest
  Vec3 lean;               // slope of the displacement along the normal
  double push = 0;         // N, along the normal
  Vec3 inward;             // unit, of its law
  Easing* turn = nullptr;  // of a disc that goes on in each step, not only where it slips
  bool begins = false;
};

// One contact as a tool asks for it, before the contact model turns it into constraints.
struct ContactWish {
  ContactId contact;
  Vec3 displacement;       // u*, m; zero along axes that are not imposed
  std::uint32_t axes = 7;  // of x, y, z
  double disc_radius = 0;  // m; 0: a point
  ContactLaw law = ContactLaw::sticking;
  double friction = 0;
  Vec3 outward, tangent;             // unit and orthogonal; where contacts have frames
  double slack = 0;                  // m, by which the displacement along the inward normal is to be less
  const DiscSlide* slide = nullptr;  // of a disc whose law is along its own normal
  bool moved = false;                // its frame may have changed although its surface point is the same
};

// The nodes below one end of a link, with weights that sum to one. No nodes: the end does not move with the tissue.
struct LinkEnd {
  static constexpr int kMostNodes = 8;
  std::int32_t count = 0, unused = 0;
  std::int32_t node[kMostNodes] = {};
  double weight[kMostNodes] = {};
  Mat3 local;        // m/N, compliance below its disc that the mesh does not resolve
  ContactDisc disc;  // in x, y, z
  // m, in the link's frame:
  Vec3 rest;
  Vec3 moved;   // by the contacts of the last step
  Vec3 driven;  // by the motions of this step

  Vec3 at() const { return rest + moved + driven; }
};

// One link as it asks for its rows (links.h).
struct LinkWish {
  std::int32_t link = 0, thread = 0;  // thread: the first link of the thread that it is a part of
  bool joined = false;                // it shares the row of the part before it
  double share = 1;                   // of the row's reaction that acts on the ends
  const LinkEnd* ends = nullptr;      // [2]
  ContactLaw law = ContactLaw::sticking;
  Vec3 along;           // unit; where the law is not sticking, the direction of its only row
  Mat3 frame;           // of a link of a world that sticks: its rows, unit and orthogonal
  Vec3 target;          // m: x along the row, or x, y, z
  double softness = 0;  // m/N, of the link itself
};

// One patch of a grasp as it asks for its rows (grasp.h): constraints on the same nodes with other weights.
struct GraspWish {
  ContactId contact;
  const std::int32_t* node = nullptr;  // [count]
  std::int32_t count = 0, parts = 0;
  const double* weight[3] = {};        // [parts][count]
  Mat3 local[3];                       // m/N; of the gradients 1/(N m)
  Vec3 target[3];                      // m; of the gradients without unit
  const ContactDisc* discs = nullptr;  // [parts] in x, y, z
};

// One place that a needle holds, as it asks for its rows (needle.h).
struct NeedleWish {
  static constexpr int kNodes = 4;
  ConstraintId id;                                        // ascending over all needles of an organ
  const std::int32_t *node = nullptr, *column = nullptr;  // [kNodes]
  const double* weight = nullptr;                         // [kNodes]
  Vec3 frame[3];                                          // unit, orthogonal: the axis and two directions across it
  std::uint32_t axes = 7;                                 // bits 1, 2, 4: which rows of the frame are imposed
  ContactLaw law = ContactLaw::sticking;
  double limit = 0;              // N, of the reaction along the axis; 0: none
  double along = 0, across = 0;  // m/N: compliance that the mesh does not resolve
  Vec3 target;                   // m, along the rows of the frame
};

// One organ's part in a pair of places of two organs that must not pass through one another.
struct PairWish {
  ContactId contact;                   // ascending over the pairs of an organ; index: the other organ
  const std::int32_t* node = nullptr;  // [count] with a tensor column
  const double* weight = nullptr;      // [count]
  std::int32_t count = 0;
  Vec3 row[3];  // unit, orthogonal: the first one along the force that the other organ exerts
  ContactLaw law = ContactLaw::unilateral;
  double friction = 0;
};

class ContactRows {
 public:
  // What the constraints are made from; borrowed. rest and patch are nullptr where no effect needs them.
  struct Source {
    palpate_contact_model model;
    const std::int32_t* column_of_node;  // [Ns] or -1
    const std::int32_t* triangles;       // [F][3]
    const double* rest;                  // [Ns][3] m
    ContactPatch* patch;
    bool slides;  // discs may have a DiscSlide
  };
  bool create(SceneMemory& memory, const Source& source, std::int32_t node_capacity, std::int32_t constraint_capacity);

  // Starts a step without contacts, of which `contacts` will be asked for. Those of the last step are kept, so that an unchanged
  // patch need not be computed again.
  void begin(std::int32_t contacts);
  void forget() { last_.constraint_count = 0; }
  // Whether discs may have a DiscSlide: the answer for the whole scene, whose definition does not keep its fine surface.
  bool discs_slide() const { return source_.slides; }

  // Both return step flags; *made: whether there is a contact. Call them in ascending order of tool and point.
  std::uint32_t add_node(const ContactWish& wish, std::int32_t node, bool* made);
  // At a surface point. Vertices without a tensor column give their weight to the others: the weights still sum to one, and the
  // force stays bounded near a fixed border.
  // A disc or an interpolated point gets no more nodes than leave as many to each contact that is still to come (thin_nodes).
  std::uint32_t add_contact(const ContactWish& wish, const SurfacePoint& surface_point, bool* made);
  // Whether add_contact() would compute a disc anew (ContactPatch::kToPress). If the wish may not have it, add_contact_as_before() gives it
  // the disc of the last step, wherever that was; false: there was none.
  bool presses(const ContactWish& wish, const SurfacePoint& surface_point);
  bool add_contact_as_before(const ContactWish& wish);

  // The rows of a grasp's patch, after the grips of its tool. Returns the first of its constraints; -1: there is no room.
  std::int32_t add_grasp(const GraspWish& wish);
  // The rows of a needle's place, after the contacts and grasps of all tools. Returns its constraint; -1: there is no room.
  std::int32_t add_needle(const NeedleWish& wish);
  // Keeps so much of the capacity for pairs and links of the world alone. Call it once.
  void keep_for_pairs(std::int32_t nodes, std::int32_t constraints) {
    nodes_for_pairs_ = nodes, constraints_for_pairs_ = constraints;
  }
  // The rows of a pair, after all else, without a target. Returns its constraint; -1: there is no room.
  std::int32_t add_pair(const PairWish& pair);

  // Gives constraint p of this step another target; the caller then solves the step again.
  void set_target(std::int32_t p, Vec3 target) { set_.target[p] = target; }

  // The rows of a link, after all contacts, in ascending order of links. Returns its constraint; -1: there is no room.
  std::int32_t add_link(const LinkWish& wish);
  // The same of the links of a world, after all else.
  std::int32_t add_world_link(const LinkWish& wish);

  // Takes the constraints from `first` on out of this step again.
  void take_back(std::int32_t first);
  // In place of those from `first` on, which are of one contact: `count` constraints as an earlier step had them, with their nodes, with
  // the present targets. False, with nothing changed, where there is no room, or a target has no counterpart.
  bool hold_as_before(std::int32_t first, const ContactConstraint* before, std::int32_t count,
                      const ContactNode* nodes);

  const ContactConstraints& set() const { return set_; }

 private:
  bool create_set(SceneMemory& memory, std::int32_t nodes, std::int32_t constraints, ContactConstraints* set);
  int nearest_vertex(const SurfacePoint& surface_point, const std::int32_t* node, const double* weight,
                     int count) const;
  std::uint32_t hold_node(const ContactWish& wish, std::int32_t node, bool* made);
  std::uint32_t hold_surface_point(const ContactWish& wish, const SurfacePoint& surface_point, bool* made);
  std::uint32_t add_patch(const ContactWish& wish, const SurfacePoint& surface_point, bool* made);
  bool is_disc(const ContactWish& wish) const { return source_.model == PALPATE_CONTACT_PATCH && wish.disc_radius > 0; }
  const ContactConstraint* patch_of_last_step(const ContactWish& wish);
  bool stays(const ContactConstraint& old, const ContactWish& wish, const SurfacePoint& surface_point) const;
  void add_patch_of_last_step(const ContactWish& wish);
  bool has_room(std::int32_t constraints, std::int32_t nodes) const;
  void make_link(const LinkWish& link, ContactSource source);
  std::int32_t nodes_for_one() const;
  ContactConstraint& add_constraint(const ContactWish& wish, std::int32_t part);
  void add_held_node(const ContactWish& wish, ContactConstraint& constraint, std::int32_t node, double weight);
  void set_frame(const ContactWish& wish, ContactConstraint& constraint);
  ContactWish along_own_normal(const ContactWish& wish, const DiscPlace& place, const ContactConstraint* before) const;

  Source source_ = {};
  ContactConstraints set_, last_;
  std::int32_t next_in_last_ = 0;
  std::int32_t nodes_for_pairs_ = 0, constraints_for_pairs_ = 0;
  std::int32_t to_come_ = 0;  // contacts that will be asked for, the present one included
};

}  // namespace palpate
