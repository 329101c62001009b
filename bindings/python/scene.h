// palpate.Scene in C++: one organ under one set of effects, alone or in a world. touch and shape run without the interpreter's lock.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "bindings/python/effects.h"

namespace palpate::python {

// The bytes that save returned.
inline State state_of(const HeldBuffer& bytes) {
  if (bytes.size() == 0)
    throw Error({PALPATE_ERROR_TRUNCATED, 0, "the state has no bytes; expected those that save returned"});
  State state(bytes.size());
  std::memcpy(state.get(), bytes.data(), bytes.size());
  return state;
}

struct PlanPass {
  std::string name, half, sections;
  std::uint64_t mapped_bytes, memory_bytes;
};

// A copy of the states 0, 1, ... of a scene or world until there is none.
template <class State, class Owner>
py::array states_of(const State* (*state)(const Owner*, std::int32_t), const Owner* of) {
  std::int32_t count = 0;
  while (state(of, count)) ++count;
  py::array_t<State> states(std::vector<py::ssize_t>{count});
  for (std::int32_t i = 0; i < count; ++i) states.mutable_data()[i] = *state(of, i);
  return states;
}

class HeldScene {
 public:
  using Places = py::array_t<palpate_inside_place, py::array::c_style | py::array::forcecast>;

  HeldScene(std::shared_ptr<HeldBundle> bundle, Effects effects)
      : HeldScene(std::move(bundle), effects, nullptr, nullptr) {
    owned_ = create(bundle_->bundle, effects.def);
    scene_ = owned_.get();
  }
  // The scene of an organ of a world, which stays alive as long as this object.
  HeldScene(std::shared_ptr<HeldBundle> bundle, const Effects& effects, palpate_scene* scene,
            std::shared_ptr<void> world)
      : bundle_(std::move(bundle)),
        world_(std::move(world)),
        def_(effects.def),
        vertex_count_(effects.def.render_mesh.vertex_count),
        scene_(scene) {
    def_.render_mesh = palpate_default_render_mesh();  // the caller may release its arrays now
    def_.fine_surface = palpate_default_fine_surface();
  }

  std::shared_ptr<HeldContacts> make_contacts() const {
    return std::make_shared<HeldContacts>(palpate_contacts_bytes(scene_));
  }
  std::shared_ptr<HeldBundle> bundle() const { return bundle_; }

  std::int32_t shape_node_count() const {
    const palpate_bundle_info info = bundle_->bundle.describe();
    if (def_.shape == PALPATE_SHAPE_OFF) return 0;
    return def_.shape == PALPATE_SHAPE_SURFACE ? info.surface_node_count : info.node_count;
  }

  py::object touch(const py::iterable& tools, double dt, HeldContacts& contacts) {
    if (world_) throw py::value_error("touch: expected a scene of its own, found one of a world; touch the world");
    const InUse use(touching_, kTouching), contacts_use(contacts.in_use, kContactsInUse);
    if (contacts.bytes < palpate_contacts_bytes(scene_))
      throw py::value_error("contacts: expected contacts of this scene's make_contacts, found smaller ones");
    Obeyed obeyed;
    obeyed.add(def_);
    copies_.take(tools, obeyed);
    return step_flags(without_lock([&] {
      return palpate_scene_touch(scene_, copies_.data(), copies_.count(), dt, contacts.contacts.get(), contacts.bytes);
    }));
  }

  std::int32_t deform() {
    const InUse use(deforming_, kDeforming);
    const std::int32_t evaluations = without_lock([&] { return palpate_scene_deform(scene_); });
    if (evaluations < 0)
      throw py::value_error("deform: expected a scene with deformation=\"large-beside\" or \"large-renewed\"");
    return evaluations;
  }

  std::int32_t vertex_count() const { return vertex_count_; }

  py::object skin(const py::object& displacements, const py::object& positions, const py::object& normals,
                  const py::object& report, const py::object& disc_normals) {
    const InUse use(shaping_, "shape already runs on another thread");
    palpate_shape_out shape = palpate_default_shape_out();
    shape.node_count = bundle_->bundle.describe().surface_node_count;
    shape.displacements = writable(displacements, "displacements", shape.node_count);
    palpate_skin_out out = palpate_default_skin_out();
    out.positions = writable(positions, "positions", vertex_count_);
    out.normals = writable(normals, "normals", vertex_count_);
    out.vertex_capacity = vertex_count_;
    if (!report.is_none()) out.report = copy_of(report);
    out.disc_normals = writable(disc_normals, "disc_normals", 0);
    if (out.disc_normals) out.disc_capacity = static_cast<std::int32_t>(py::len(disc_normals));
    return step_flags(without_lock([&] { return palpate_scene_skin(scene_, &shape, &out); }));
  }

  py::object shape(HeldContacts& contacts, const py::object& positions, const py::object& displacements) {
    const InUse use(shaping_, "shape already runs on another thread"), contacts_use(contacts.in_use, kContactsInUse);
    palpate_shape_out out = palpate_default_shape_out();
    out.node_capacity = shape_node_count();
    out.positions = writable(positions, "positions", out.node_capacity);
    out.displacements = writable(displacements, "displacements", out.node_capacity);
    return step_flags(without_lock([&] { return palpate_scene_shape(scene_, contacts.contacts.get(), &out); }));
  }

  py::object normals(const py::object& positions, const py::object& normals) {
    const std::int32_t nodes = bundle_->bundle.describe().surface_node_count;
    palpate_shape_out shape = palpate_default_shape_out();
    shape.node_count = nodes, shape.positions = writable(positions, "positions", nodes);
    float* out = writable(normals, "normals", nodes);
    return step_flags(without_lock([&] { return palpate_scene_normals(scene_, &shape, out, nodes); }));
  }

  py::array locate(const Numbers& points, double farthest) const {
    if (points.ndim() != 2 || points.shape(1) != 3) throw py::value_error("points: expected shape [points, 3]");
    py::array_t<palpate_inside_place> places(points.shape(0));
    palpate_inside_place* const out = places.mutable_data();
    const auto count = static_cast<std::int32_t>(points.shape(0));
    const std::int32_t missing =
        without_lock([&] { return palpate_scene_locate(scene_, points.data(), count, farthest, out); });
    if (missing < 0 && count > 0)
      throw py::value_error("locate: expected a scene with inside=True, and a farthest distance of 0 or above");
    return places;
  }
  py::object inside(const py::object& displacements, const py::object& strains, const py::object& stresses,
                    const py::object& pressures, const py::object& von_mises, const py::object& principal) {
    const InUse use(shaping_, kShaping);
    palpate_shape_out shape = palpate_default_shape_out();
    shape.node_count = shape_node_count();
    shape.displacements = writable(displacements, "displacements", shape.node_count);
    palpate_inside_out out = inside_out(shape.node_count, strains, stresses, pressures, von_mises, principal);
    return step_flags(without_lock([&] { return palpate_scene_inside(scene_, &shape, &out); }));
  }
  py::object inside_at(const Places& places, const py::object& displacements, const py::object& strains,
                       const py::object& stresses, const py::object& pressures, const py::object& von_mises,
                       const py::object& principal) {
    const InUse use(shaping_, kShaping);
    const auto count = static_cast<std::int32_t>(places.size());
    palpate_inside_out out = inside_out(count, strains, stresses, pressures, von_mises, principal);
    out.displacements = writable(displacements, "displacements", count);
    return step_flags(without_lock([&] { return palpate_scene_inside_at(scene_, places.data(), count, &out); }));
  }
  py::object carry(const py::object& positions, const Places& places, const py::object& moved) {
    const InUse use(shaping_, kShaping);
    palpate_shape_out shape = palpate_default_shape_out();
    shape.node_count = shape_node_count();
    shape.positions = writable(positions, "positions", shape.node_count);
    const auto count = static_cast<std::int32_t>(places.size());
    float* const out = writable(moved, "moved", count);
    return step_flags(without_lock([&] { return palpate_scene_carry(scene_, &shape, places.data(), count, out); }));
  }

  py::tuple crossings(const py::object& positions) {
    const InUse use(shaping_, kShaping);
    palpate_shape_out shape = palpate_default_shape_out();
    shape.node_count = shape_node_count();
    shape.positions = writable(positions, "positions", shape.node_count);
    constexpr std::int32_t most = 64;
    palpate_crossing found[most];
    palpate_crossings_out out = palpate_default_crossings_out();
    out.capacity = most, out.crossings = found;
    const palpate_step_flags flags = without_lock([&] { return palpate_scene_crossings(scene_, &shape, &out); });
    return py::make_tuple(step_flags(flags), out.checks, out.pairs, py::array_t<palpate_crossing>(out.count, found));
  }

  py::object cast_ray(const Numbers& origin, const Numbers& direction, HeldContacts* contacts, double longest) {
    double from[3], along[3];
    set_numbers(from, origin, "origin"), set_numbers(along, direction, "direction");
    return ask<palpate_surface_hit>(contacts, [&](const palpate_contacts* of, palpate_surface_hit* hit) {
      return palpate_scene_cast_ray(scene_, of, from, along, longest, hit);
    });
  }
  py::object closest_point(const Numbers& point, HeldContacts* contacts, double farthest) {
    double p[3];
    set_numbers(p, point, "point");
    return ask<palpate_surface_hit>(contacts, [&](const palpate_contacts* of, palpate_surface_hit* hit) {
      return palpate_scene_closest_point(scene_, of, p, farthest, hit);
    });
  }
  py::object signed_distance(const Numbers& point, HeldContacts* contacts) {
    double p[3];
    set_numbers(p, point, "point");
    return ask<double>(contacts, [&](const palpate_contacts* of, double* distance) {
      return palpate_scene_signed_distance(scene_, of, p, distance);
    });
  }

  py::object report() {
    const InUse use(touching_, kTouching);
    const palpate_contact_report* report = reported();
    return py::make_tuple(py::array_t<palpate_contact>(report->contact_count, palpate_report_contact(report, 0)),
                          py::array_t<palpate_contact_event>(report->event_count, palpate_report_event(report, 0)));
  }
  py::bytes report_bytes() {
    const InUse use(touching_, kTouching);
    const palpate_contact_report* report = reported();
    return py::bytes(reinterpret_cast<const char*>(report), report->used_bytes);
  }
  static palpate_pose pose_of(const Numbers& position, const Numbers& orientation, const Numbers& velocity,
                              const Numbers& angular_velocity) {
    palpate_pose pose = palpate_default_pose();
    set_numbers(pose.position, position, "position");
    set_numbers(pose.orientation, orientation, "orientation");
    set_numbers(pose.velocity, velocity, "velocity");
    set_numbers(pose.angular_velocity, angular_velocity, "angular_velocity");
    return pose;
  }
  void set_pose(const Numbers& position, const Numbers& orientation, const Numbers& velocity,
                const Numbers& angular_velocity) {
    const InUse use(touching_, kTouching);
    const palpate_pose pose = pose_of(position, orientation, velocity, angular_velocity);
    throw_unless_ok([&](palpate_error* error) { return palpate_scene_set_pose(scene_, &pose, error); });
  }

  void set_links(const py::iterable& links) {
    const InUse use(touching_, kTouching);
    link_copies_.take(links);
    throw_unless_ok([&](palpate_error* error) {
      return palpate_scene_set_links(scene_, link_copies_.data(), link_copies_.count(), error);
    });
  }
  void set_motions(const Numbers& amounts) {
    const InUse use(touching_, kTouching);
    if (amounts.ndim() != 1) throw py::value_error("amounts: expected one number for each motion of the bundle");
    throw_unless_ok([&](palpate_error* error) {
      return palpate_scene_set_motions(scene_, amounts.data(), static_cast<std::int32_t>(amounts.size()), error);
    });
  }
  void hold_volume(std::int32_t motion, std::optional<double> volume) {
    const InUse use(touching_, kTouching);
    throw_unless_ok([&](palpate_error* error) {
      return palpate_scene_hold_volume(scene_, motion, volume.has_value(), volume.value_or(0), error);
    });
  }
  py::array motion_states() {
    const InUse use(touching_, kTouching);
    return states_of(palpate_scene_motion_state, scene_);
  }
  void set_load(std::int32_t load, const Numbers& vector, bool per_area, bool in_world) {
    const InUse use(touching_, kTouching);
    double numbers[3];
    set_numbers(numbers, vector, "vector");
    const auto kind = static_cast<palpate_load_kind>((per_area ? PALPATE_LOAD_TRACTION : PALPATE_LOAD_FORCE) +
                                                     (in_world ? PALPATE_LOAD_FORCE_IN_WORLD : PALPATE_LOAD_FORCE));
    throw_unless_ok([&](palpate_error* error) { return palpate_scene_set_load(scene_, load, kind, numbers, error); });
  }
  py::array load_states() {
    const InUse use(touching_, kTouching);
    return states_of(palpate_scene_load_state, scene_);
  }
  void set_obstacle_pose(std::int32_t obstacle, const Numbers& position, const Numbers& orientation,
                         const Numbers& velocity, const Numbers& angular_velocity) {
    const InUse use(touching_, kTouching);
    const palpate_pose pose = pose_of(position, orientation, velocity, angular_velocity);
    throw_unless_ok(
        [&](palpate_error* error) { return palpate_scene_set_obstacle_pose(scene_, obstacle, &pose, error); });
  }
  py::array obstacle_states() {
    const InUse use(touching_, kTouching);
    return states_of(palpate_scene_obstacle_state, scene_);
  }
  void set_blade(std::int32_t number, const Numbers& points, const std::optional<Numbers>& direction, double toughness,
                 double friction, double width) {
    const InUse use(touching_, kTouching);
    if (points.ndim() != 2 || points.shape(1) != 3 || points.shape(0) < 2 || points.shape(0) > PALPATE_MAX_BLADE_POINTS)
      throw py::value_error("points: expected shape [points, 3], 2 to " + std::to_string(PALPATE_MAX_BLADE_POINTS) +
                            " points; found " + std::string(py::str(points.attr("shape"))));
    palpate_blade blade = palpate_default_blade();
    blade.points = points.data(), blade.point_count = static_cast<std::int32_t>(points.shape(0));
    if (direction) set_numbers(blade.direction, *direction, "direction");
    blade.toughness = toughness, blade.friction = friction, blade.width = width;
    place_blade(number, blade);
  }
  void withdraw_blade(std::int32_t number) {
    const InUse use(touching_, kTouching);
    place_blade(number, palpate_default_blade());
  }
  py::object blade_state(std::int32_t number) { return record_of(palpate_scene_blade_state, number); }
  void remove_tissue(const Numbers& centre, double radius, double held, double needed) {
    const InUse use(touching_, kTouching);
    double numbers[3];
    set_numbers(numbers, centre, "centre");
    throw_unless_ok([&](palpate_error* error) {
      return palpate_scene_remove_tissue(scene_, numbers, radius, held, needed, error);
    });
  }
  py::object cut_state() {
    const InUse use(touching_, kTouching);
    return record(palpate_scene_cut_state(scene_));
  }
  py::tuple cut_surface() {
    const InUse use(touching_, kTouching);
    const std::int32_t count = palpate_scene_cut_surface(scene_, nullptr, nullptr, 0);
    py::array_t<std::int32_t> triangles(std::vector<py::ssize_t>{count, 3});
    py::array_t<bool> is_lip(std::vector<py::ssize_t>{count});
    palpate_scene_cut_surface(scene_, triangles.mutable_data(), reinterpret_cast<std::uint8_t*>(is_lip.mutable_data()),
                              count);
    return py::make_tuple(triangles, is_lip);
  }
  py::array link_states() {
    const InUse use(touching_, kTouching);
    return states_of(palpate_scene_link_state, scene_);
  }
  py::object given_force_state(std::int32_t id) { return record_of(palpate_scene_given_force_state, id); }
  py::object grasp_state(std::int32_t id) { return record_of(palpate_scene_grasp_state, id); }
  py::object needle_state(std::int32_t id) { return record_of(palpate_scene_needle_state, id); }

  void reset() {
    const InUse use(touching_, kTouching);
    palpate_scene_reset(scene_);
  }
  py::bytes save() {
    const InUse use(touching_, kTouching), deform_use(deforming_, kDeforming);
    State state(palpate_scene_state_bytes(scene_));
    throw_unless_ok(
        [&](palpate_error* error) { return palpate_scene_save(scene_, state.get(), state.bytes(), error); });
    return py::bytes(static_cast<const char*>(state.get()), state.bytes());
  }
  void restore(const py::buffer& data) {
    const HeldBuffer bytes(data);
    const InUse use(touching_, kTouching), deform_use(deforming_, kDeforming);
    const State state = state_of(bytes);
    throw_unless_ok(
        [&](palpate_error* error) { return palpate_scene_restore(scene_, state.get(), state.bytes(), error); });
  }
  void reset_tool(std::int32_t id) {
    const InUse use(touching_, kTouching);
    palpate_scene_reset_tool(scene_, id);
  }

  std::int64_t most_operations() const { return palpate_scene_most_operations(scene_); }

  std::vector<PlanPass> plan() const {
    std::vector<PlanPass> plan;
    while (const palpate_plan_pass* pass = palpate_scene_plan(scene_, static_cast<std::int32_t>(plan.size())))
      plan.push_back({pass->name, pass->half, pass->sections, pass->mapped_bytes, pass->memory_bytes});
    return plan;
  }

 private:
  static constexpr const char* kShaping = "shape already runs on another thread";
  static constexpr const char *kTouching = "touch already runs on another thread",
                              *kDeforming = "deform already runs on another thread";

  const palpate_contact_report* reported() {
    if (const palpate_contact_report* report = palpate_scene_report(scene_)) return report;
    throw py::value_error("the scene reports no contacts; make it with report=\"contacts\"");
  }
  // A copy of what a tool's grasp or needle does, or None.
  template <class State>
  py::object record_of(const State* (*state_of_tool)(const palpate_scene*, std::int32_t), std::int32_t id) {
    const InUse use(touching_, kTouching);
    return record(state_of_tool(scene_, id));
  }
  // A copy; None of none.
  template <class State>
  static py::object record(const State* state) {
    if (!state) return py::none();
    return py::array_t<State>(1, state)[py::int_(0)];
  }
  void place_blade(std::int32_t number, const palpate_blade& blade) {
    throw_unless_ok([&](palpate_error* error) { return palpate_scene_set_blade(scene_, number, &blade, error); });
  }

  static Scene create(const Bundle& bundle, const SceneDef& def) {
    const py::gil_scoped_release released;
    return Scene(bundle, def);
  }

  // A report as bytes, 8-byte aligned as the API asks. One that says that it is longer than it is counts as damaged: it becomes zeros.
  const palpate_contact_report* copy_of(const py::object& report) {
    const std::string bytes = py::cast<py::bytes>(report);
    report_copy_.assign(std::max(bytes.size(), sizeof(palpate_contact_report)) / 8 + 1, 0);
    palpate_contact_report head = {};
    std::memcpy(&head, bytes.data(), std::min(bytes.size(), sizeof head));
    if (head.used_bytes <= bytes.size()) std::memcpy(report_copy_.data(), bytes.data(), bytes.size());
    return reinterpret_cast<const palpate_contact_report*>(report_copy_.data());
  }

  // Answers a query: a Hit, None or a number.
  template <class Answer, class Query>
  py::object ask(HeldContacts* contacts, Query query) {
    const InUse use(asking_, "a query already runs on another thread");
    std::optional<InUse> contacts_use;
    if (contacts) contacts_use.emplace(contacts->in_use, kContactsInUse);
    Answer answer = {};
    if constexpr (std::is_same_v<Answer, palpate_surface_hit>) answer = palpate_default_surface_hit();
    const palpate_step_flags flags =
        without_lock([&] { return query(contacts ? contacts->contacts.get() : nullptr, &answer); });
    if (flags & (PALPATE_STEP_BAD_INPUT | PALPATE_STEP_OTHER_BUNDLE))
      throw py::value_error(
          def_.queries.queries == PALPATE_QUERIES_OFF
              ? "the scene answers no queries; make it with queries=\"on\""
              : "expected numbers that are finite, a direction that is not zero, a distance above zero, and contacts "
                "that a touch of this bundle filled");
    if constexpr (std::is_same_v<Answer, palpate_surface_hit>)
      if (!answer.hit) return py::none();
    return py::cast(answer);
  }
  template <class Step>
  static std::invoke_result_t<Step> without_lock(Step step) {
    const py::gil_scoped_release released;
    return step();
  }

  static palpate_inside_out inside_out(std::int32_t rows, const py::object& strains, const py::object& stresses,
                                       const py::object& pressures, const py::object& von_mises,
                                       const py::object& principal) {
    palpate_inside_out out = palpate_default_inside_out();
    out.capacity = rows;
    out.strains = writable(strains, "strains", rows, 6), out.stresses = writable(stresses, "stresses", rows, 6);
    out.pressures = writable(pressures, "pressures", rows, 1);
    out.von_mises = writable(von_mises, "von_mises", rows, 1);
    out.principal = writable(principal, "principal", rows);
    return out;
  }

  // The first number of a caller's array, which the step fills. columns: 1: the array has one dimension.
  static float* writable(const py::object& object, const char* name, std::int32_t rows, int columns = 3) {
    if (object.is_none()) return nullptr;
    if (!py::isinstance<py::array_t<float>>(object))
      throw py::type_error(
          std::string(name) + ": expected a numpy array of float32; found " +
          std::string(py::str(py::type::of(object).attr("__name__"))) +
          (py::isinstance<py::array>(object) ? " of " + std::string(py::str(object.attr("dtype"))) : ""));
    auto array = py::reinterpret_borrow<py::array_t<float>>(object);
    const bool fits = columns == 1 ? array.ndim() == 1 : array.ndim() == 2 && array.shape(1) == columns;
    if (!fits || array.shape(0) < rows)
      throw py::value_error(std::string(name) + ": expected shape [" + std::to_string(rows) +
                            (columns == 1 ? "" : ", " + std::to_string(columns)) + "], or more rows; found " +
                            std::string(py::str(array.attr("shape"))));
    if ((array.flags() & py::array::c_style) == 0 || !array.writeable() ||
        reinterpret_cast<std::uintptr_t>(array.data()) % alignof(float) != 0)
      throw py::value_error(std::string(name) + ": expected a contiguous array that may be written to");
    return array.mutable_data();
  }

  std::shared_ptr<HeldBundle> bundle_;  // outlives the scene
  std::shared_ptr<void> world_;         // that the scene belongs to; nullptr: none
  SceneDef def_;
  std::int32_t vertex_count_;  // of the render mesh
  Scene owned_;                // empty in a world
  palpate_scene* scene_;
  std::vector<std::uint64_t> report_copy_;  // of skin
  ToolCopies copies_;
  LinkCopies<palpate_link> link_copies_;
  std::atomic_flag touching_ = ATOMIC_FLAG_INIT, deforming_ = ATOMIC_FLAG_INIT, shaping_ = ATOMIC_FLAG_INIT,
                   asking_ = ATOMIC_FLAG_INIT;
};

}  // namespace palpate::python
