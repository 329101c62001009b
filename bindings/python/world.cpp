// palpate.World: several organs and the tools that touch them, and what its touch found.
#include <algorithm>
#include <cstring>

#include "bindings/python/scene.h"

namespace palpate::python {
namespace {

// One organ of a world that is to be made.
struct HeldOrgan {
  HeldOrgan(std::shared_ptr<HeldBundle> of, Effects chosen) : bundle(std::move(of)), effects(std::move(chosen)) {}
  std::shared_ptr<HeldBundle> bundle;
  Effects effects;
  palpate_pose pose = palpate_default_pose();
};

// What a touch of a world found. Each organ's contacts are a copy, so that they go where those of a scene go.
struct HeldWorldContacts {
  explicit HeldWorldContacts(std::size_t bytes) : contacts(bytes) {}
  WorldContacts contacts;
  std::vector<std::shared_ptr<HeldContacts>> organs;
  std::atomic_flag in_use = ATOMIC_FLAG_INIT;
};

class HeldWorld : public std::enable_shared_from_this<HeldWorld> {
 public:
  HeldWorld(std::vector<std::shared_ptr<HeldOrgan>> organs, palpate_world_def def) : organs_(std::move(organs)) {
    std::vector<palpate_world_organ> all(organs_.size(), palpate_default_world_organ());
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (!organs_[k]) throw py::type_error("organs: expected Organ, found None");
      all[k].bundle = organs_[k]->bundle->bundle.get(), all[k].def = &organs_[k]->effects.def;
      all[k].pose = &organs_[k]->pose;
    }
    def.organs = all.data(), def.organ_count = static_cast<std::int32_t>(all.size());
    const py::gil_scoped_release released;
    world_ = World(def);
  }

  // The scenes of the organs: each keeps the world alive.
  std::vector<std::shared_ptr<HeldScene>> scenes() {
    std::vector<std::shared_ptr<HeldScene>> all;
    for (std::size_t k = 0; k < organs_.size(); ++k)
      all.push_back(std::make_shared<HeldScene>(organs_[k]->bundle, organs_[k]->effects,
                                                world_.scene(static_cast<std::int32_t>(k)), shared_from_this()));
    return all;
  }

  std::shared_ptr<HeldWorldContacts> make_contacts() const {
    auto contacts = std::make_shared<HeldWorldContacts>(palpate_world_contacts_bytes(world_.get()));
    for (std::int32_t k = 0; k < world_.organ_count(); ++k)
      contacts->organs.push_back(std::make_shared<HeldContacts>(palpate_contacts_bytes(world_.scene(k))));
    return contacts;
  }

  py::object touch(const py::iterable& tools, double dt, HeldWorldContacts& contacts) {
    const InUse use(touching_, kTouching), contacts_use(contacts.in_use, kContactsInUse);
    if (contacts.contacts.bytes() < palpate_world_contacts_bytes(world_.get()) ||
        contacts.organs.size() != organs_.size())
      throw py::value_error("contacts: expected contacts of this world's make_contacts, found others");
    Obeyed obeyed;  // by one of the organs
    for (const auto& organ : organs_) obeyed.add(organ->effects.def);
    copies_.take(tools, obeyed);
    palpate_step_flags flags = 0;
    {
      const py::gil_scoped_release released;
      flags = world_.touch(copies_.data(), copies_.count(), dt, contacts.contacts);
    }
    for (std::size_t k = 0; k < organs_.size(); ++k) {
      const InUse organ_use(contacts.organs[k]->in_use, kContactsInUse);
      const palpate_contacts& found = contacts.contacts.organ(static_cast<std::int32_t>(k));
      if (!contacts.organs[k]->assign(&found, found.used_bytes))
        throw py::value_error("contacts: expected contacts of this world's make_contacts, found others");
    }
    return step_flags(flags);
  }

  void set_links(const py::iterable& links) {
    const InUse use(touching_, kTouching);
    link_copies_.take(links);
    throw_unless_ok(
        [&](palpate_error* error) { return world_.set_links(link_copies_.data(), link_copies_.count(), error); });
  }
  py::array link_states() {
    const InUse use(touching_, kTouching);
    return states_of(palpate_world_link_state, world_.get());
  }

  void reset() {
    const InUse use(touching_, kTouching);
    world_.reset();
  }
  void reset_tool(std::int32_t id) {
    const InUse use(touching_, kTouching);
    world_.reset_tool(id);
  }
  py::bytes save() {
    const InUse use(touching_, kTouching);
    State state;
    throw_unless_ok([&](palpate_error* error) { return world_.save(state, error); });
    return py::bytes(static_cast<const char*>(state.get()), state.bytes());
  }
  void restore(const py::buffer& data) {
    const HeldBuffer bytes(data);
    const InUse use(touching_, kTouching);
    const State state = state_of(bytes);
    throw_unless_ok([&](palpate_error* error) { return world_.restore(state, error); });
  }

 private:
  static constexpr const char* kTouching = "touch already runs on another thread";

  std::vector<std::shared_ptr<HeldOrgan>> organs_;  // their bundles outlive the world
  World world_;
  ToolCopies copies_;
  LinkCopies<palpate_world_link> link_copies_;
  std::atomic_flag touching_ = ATOMIC_FLAG_INIT;
};

std::shared_ptr<HeldWorld> make_world(std::vector<std::shared_ptr<HeldOrgan>> organs, double friction,
                                      std::int32_t max_pairs, double force_limit, double force_slew,
                                      double torque_limit, double torque_slew, std::int32_t max_links) {
  palpate_world_def def = palpate_default_world_def();
  def.friction = friction, def.max_pairs = max_pairs, def.max_links = max_links;
  def.force_limit = force_limit, def.force_slew = force_slew;
  def.torque_limit = torque_limit, def.torque_slew = torque_slew;
  return std::make_shared<HeldWorld>(std::move(organs), def);
}

void add_organ(py::module_& module) {
  py::class_<HeldOrgan, std::shared_ptr<HeldOrgan>> type(
      module, "Organ",
      "One organ of a World: its bundle, its effects, and where it lies. Its scene is in World.scenes.");
  takes_effects(type,
                "The keywords are those of Scene. max_tools and max_points of all organs of a world must be the same.");
  const auto numbers = [&type](const char* name, auto member, const char* about) {
    using Array = std::remove_reference_t<decltype(std::declval<palpate_pose>().*member)>;
    type.def_property(
        name, [member](const HeldOrgan& self) { return py::array_t<double>(std::extent_v<Array>, self.pose.*member); },
        [member, name](HeldOrgan& self, const Numbers& to) { set_numbers(self.pose.*member, to, name); }, about);
  };
  numbers("position", &palpate_pose::position,
          "float64 [3], m, in the world; where the world is made: set it before. Default 0");
  numbers("orientation", &palpate_pose::orientation,
          "float64 [4], a quaternion w, x, y, z; the same. Default 1, 0, 0, 0");
}

void add_world_contacts(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(palpate_world_tool_state, force, force_raw, torque, torque_raw, id, organ_count, contact_count,
                       slip_count, release_count, flags);
  PYBIND11_NUMPY_DTYPE(palpate_world_organ_state, contacts_offset, flags, near_tools, force, torque, pressed);
  PYBIND11_NUMPY_DTYPE(palpate_world_pair, organ, node, triangle, barycentric, place, normal, force, pressure, gap,
                       overlap);
  const auto of = [](const py::object& self) -> const WorldContacts& {
    return self.cast<HeldWorldContacts&>().contacts;
  };
  py::class_<HeldWorldContacts, std::shared_ptr<HeldWorldContacts>>(
      module, "WorldContacts",
      "What a touch of a World found. World.make_contacts makes it; arrays are read-only views of the last step,\n"
      "whose lengths are those at the time they were asked for.")
      .def_property_readonly(
          "force",
          [of](const py::object& self) {
            const WorldContacts& contacts = of(self);
            return view_of(self, contacts.tool(0).force, {contacts->tool_count, 3},
                           {sizeof(palpate_world_tool_state), sizeof(double)});
          },
          "float64 [tools, 3], N, on each tool, of all organs together, within the world's limits: send it to a device")
      .def_property_readonly(
          "tools",
          [of](const py::object& self) {
            return view_of(self, &of(self).tool(0), {of(self)->tool_count}, {sizeof(palpate_world_tool_state)});
          },
          "structured [tools]: force, force_raw, torque, torque_raw ([3] each), id, organ_count (organs that the tool\n"
          "is in contact with), contact_count, slip_count, release_count, flags")
      .def_property_readonly(
          "organ_states",
          [of](const py::object& self) {
            return view_of(self, &of(self).state(0), {of(self)->organ_count}, {sizeof(palpate_world_organ_state)});
          },
          "structured [organs]: flags, near_tools, force (N, in the world, on the organ, by all tools), torque (N m,\n"
          "about the origin of the organ's frame), pressed (N, by all other organs, without links)")
      .def_property_readonly(
          "pairs",
          [of](const py::object& self) {
            return view_of(self, &of(self).pair(0), {of(self)->pair_count}, {sizeof(palpate_world_pair)});
          },
          "structured [pairs], the places where two organs touch or may touch: organ ([2]: of the vertex, of the\n"
          "place), node, triangle, barycentric, place (m, in the world), normal (outward from organ[1]), force (N, on\n"
          "organ[0]), pressure (Pa), gap (m), overlap (m, at rest)")
      .def_readonly(
          "organs", &HeldWorldContacts::organs,
          "list of Contacts, one of each organ, for shape and the queries of World.scenes; a touch fills them")
      .def_property_readonly(
          "flags", [](const HeldWorldContacts& self) { return step_flags(self.contacts->flags); },
          "StepFlags that touch returned, of all organs and the world")
      .def_property_readonly(
          "step", [](const HeldWorldContacts& self) { return self.contacts->step; }, "number of the touch, from 1");
}

}  // namespace

void add_world(py::module_& module) {
  const palpate_world_def start = palpate_default_world_def();
  add_organ(module);
  add_world_contacts(module);
  py::class_<HeldWorld, std::shared_ptr<HeldWorld>>(module, "World",
                                                    "Several organs and the tools that touch them. It keeps their "
                                                    "bundles open. touch runs without the interpreter's\n"
                                                    "lock; the scenes' shape may run on other threads meanwhile.")
      .def(py::init(&make_world), py::arg("organs"), py::kw_only(), py::arg("friction") = start.friction,
           py::arg("max_pairs") = start.max_pairs, py::arg("force_limit") = start.force_limit,
           py::arg("force_slew") = start.force_slew, py::arg("torque_limit") = start.torque_limit,
           py::arg("torque_slew") = start.torque_slew, py::arg("max_links") = start.max_links,
           "organs: of Organ; their bundles may be the same. Raises Error, which names the organ.\n"
           "max_pairs: places at most where organs are held apart; 0: they pass through one another. Above 0 it needs\n"
           "collision=\"deformed\" of all organs. Each may have a deformation of its own: call deform of its scene in "
           "a thread\n"
           "friction: Coulomb's coefficient between organs\n"
           "max_links: links that set_links may give\n"
           "force_limit, N; force_slew, N/s; torque_limit, N m; torque_slew, N m/s: of each tool, all organs together")
      .def_property_readonly("scenes", &HeldWorld::scenes,
                             "list of Scene, one of each organ: for shape, skin, queries, report, links and set_pose.\n"
                             "Their touch, save and restore are the world's.")
      .def("make_contacts", &HeldWorld::make_contacts, "WorldContacts of this world's size.")
      .def("touch", &HeldWorld::touch, py::arg("tools"), py::arg("dt"), py::arg("contacts"),
           "The haptic half of all organs. tools: of Tool, in the world; the grips and the grasp of a tool hold organ "
           "Tool.organ.\n"
           "dt: s since the last touch. Fills contacts and returns StepFlags of all organs together; 0 is full trust.")
      .def("set_links", &HeldWorld::set_links, py::arg("links"),
           "The world's links, of WorldLink, in place of those before; one with an id, kind, organs and ends as\n"
           "before keeps its state. Raises Error, and the world keeps its links.")
      .def("link_states", &HeldWorld::link_states,
           "structured [links] as Scene.link_states, a copy of the last touch; ends and forces in the world's frame")
      .def("reset", &HeldWorld::reset, "Scene.reset of all organs.")
      .def("reset_tool", &HeldWorld::reset_tool, py::arg("id"), "Scene.reset_tool of all organs.")
      .def("save", &HeldWorld::save, "bytes: what the touches have left in all organs, as Scene.save.")
      .def("restore", &HeldWorld::restore, py::arg("state"),
           "As Scene.restore; a state that is refused leaves all organs as they were.");
}

}  // namespace palpate::python
