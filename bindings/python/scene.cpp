// palpate.Scene: one organ under one set of effects. touch and shape run without the interpreter's lock.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "bindings/python/tools.h"

namespace palpate::python {
namespace {

// The value of an enum from a word; words are in the order of the enum's values.
template <class Enum>
Enum choose(const char* effect, const std::string& word, std::initializer_list<const char*> words) {
  int value = 0;
  std::string all;
  for (const char* each : words) {
    if (word == each) return static_cast<Enum>(value);
    all += (value++ ? ", " : "") + std::string(each);
  }
  throw py::value_error(std::string(effect) + ": expected one of " + all + "; found \"" + word + "\"");
}

palpate_relaxation relaxation_of(const py::object& terms) {
  palpate_relaxation relaxation = {};
  if (terms.is_none()) return relaxation;
  relaxation.model = PALPATE_RELAXATION_PRONY;
  for (const py::handle each : terms) {
    const auto term = each.cast<std::pair<double, double>>();
    if (relaxation.terms == PALPATE_MAX_RELAXATION_TERMS)
      throw py::value_error("relaxation: expected at most " + std::to_string(PALPATE_MAX_RELAXATION_TERMS) + " terms");
    relaxation.share[relaxation.terms] = term.first;
    relaxation.time[relaxation.terms++] = term.second;
  }
  return relaxation;
}

// A render mesh while its scene is created: positions, or a tuple (positions, normals), each [vertices, 3].
struct RenderMesh {
  using Array = py::array_t<float, py::array::c_style | py::array::forcecast>;
  Array positions, normals;
  palpate_render_mesh mesh = palpate_default_render_mesh();

  explicit RenderMesh(const py::object& from) {
    const bool both = py::isinstance<py::tuple>(from);
    positions = rows(both ? from.cast<py::tuple>()[0] : from);
    if (both) normals = rows(from.cast<py::tuple>()[1]);
    if (both && normals.shape(0) != positions.shape(0))
      throw py::value_error("render_mesh: expected a normal for every position");
    mesh.positions = positions.data(), mesh.normals = both ? normals.data() : nullptr;
    mesh.vertex_count = static_cast<std::int32_t>(positions.shape(0));
  }
  static Array rows(const py::handle& from) {
    Array array = Array::ensure(from);
    if (!array || array.ndim() != 2 || array.shape(1) != 3 || array.shape(0) > INT32_MAX)
      throw py::value_error(
          "render_mesh: expected positions, or a tuple of positions and normals, of shape [vertices, 3]");
    return array;
  }
};

// A fine surface while its scene is created: a tuple of positions [vertices, 3] and triangles [triangles, 3].
struct FineSurface {
  py::array_t<float, py::array::c_style | py::array::forcecast> positions;
  py::array_t<std::int32_t, py::array::c_style | py::array::forcecast> triangles;
  palpate_fine_surface surface = palpate_default_fine_surface();

  explicit FineSurface(const py::object& from) {
    if (!py::isinstance<py::tuple>(from) || from.cast<py::tuple>().size() != 2) refuse();
    take(from.cast<py::tuple>()[0], positions), take(from.cast<py::tuple>()[1], triangles);
    surface.positions = positions.data(), surface.triangles = triangles.data();
    surface.vertex_count = static_cast<std::int32_t>(positions.shape(0));
    surface.triangle_count = static_cast<std::int32_t>(triangles.shape(0));
  }
  [[noreturn]] static void refuse() {
    throw py::value_error(
        "fine_surface: expected a tuple of positions [vertices, 3] and triangles [triangles, 3], whole numbers");
  }
  template <class Array>
  static void take(const py::handle& from, Array& array) {
    const py::array given = py::array::ensure(from);
    if (!given || given.ndim() != 2 || given.shape(1) != 3 || given.shape(0) > INT32_MAX) refuse();
    if (std::is_same_v<typename Array::value_type, std::int32_t> && given.dtype().kind() != 'i' &&
        given.dtype().kind() != 'u')
      refuse();
    array = Array::ensure(given);
    if (!array) refuse();
  }
};

struct PlanPass {
  std::string name, half, sections;
  std::uint64_t mapped_bytes;
};

class HeldScene {
 public:
  HeldScene(std::shared_ptr<HeldBundle> bundle, const palpate_scene_def& def)
      : bundle_(std::move(bundle)),
        def_(def),
        vertex_count_(def.render_mesh ? def.render_mesh->vertex_count : 0),
        scene_(create(bundle_->bundle, def_)) {
    def_.render_mesh = nullptr;  // the caller may release its arrays now
    def_.fine_surface = nullptr;
  }

  std::shared_ptr<HeldContacts> make_contacts() const {
    return std::make_shared<HeldContacts>(palpate_contacts_bytes(scene_.get()));
  }
  std::shared_ptr<HeldBundle> bundle() const { return bundle_; }

  std::int32_t shape_node_count() const {
    const palpate_bundle_info info = bundle_->bundle.describe();
    if (def_.shape == PALPATE_SHAPE_OFF) return 0;
    return def_.shape == PALPATE_SHAPE_SURFACE ? info.surface_node_count : info.node_count;
  }

  py::object touch(const py::iterable& tools, double dt, HeldContacts& contacts) {
    const InUse use(touching_, kTouching), contacts_use(contacts.in_use, kContactsInUse);
    if (contacts.bytes < palpate_contacts_bytes(scene_.get()))
      throw py::value_error("contacts: expected contacts of this scene's make_contacts, found smaller ones");
    copies_.take(tools);
    return step_flags(
        without_lock([&] { return scene_.touch(copies_.data(), copies_.count(), dt, contacts.contacts); }));
  }

  std::int32_t deform() {
    const InUse use(deforming_, kDeforming);
    const std::int32_t evaluations = without_lock([&] { return scene_.deform(); });
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
    return step_flags(without_lock([&] { return scene_.skin(shape, out); }));
  }

  py::object shape(HeldContacts& contacts, const py::object& positions, const py::object& displacements) {
    const InUse use(shaping_, "shape already runs on another thread"), contacts_use(contacts.in_use, kContactsInUse);
    palpate_shape_out out = palpate_default_shape_out();
    out.node_capacity = shape_node_count();
    out.positions = writable(positions, "positions", out.node_capacity);
    out.displacements = writable(displacements, "displacements", out.node_capacity);
    return step_flags(without_lock([&] { return scene_.shape(contacts.contacts, out); }));
  }

  py::object normals(const py::object& positions, const py::object& normals) {
    const std::int32_t nodes = bundle_->bundle.describe().surface_node_count;
    palpate_shape_out shape = palpate_default_shape_out();
    shape.node_count = nodes, shape.positions = writable(positions, "positions", nodes);
    float* out = writable(normals, "normals", nodes);
    return step_flags(without_lock([&] { return scene_.normals(shape, out, nodes); }));
  }

  py::object cast_ray(const Numbers& origin, const Numbers& direction, HeldContacts* contacts, double longest) {
    double from[3], along[3];
    set_numbers(from, origin, "origin"), set_numbers(along, direction, "direction");
    return ask<palpate_surface_hit>(contacts, [&](const palpate_contacts* of, palpate_step_flags* flags) {
      return scene_.cast_ray(of, from, along, longest, flags);
    });
  }
  py::object closest_point(const Numbers& point, HeldContacts* contacts, double farthest) {
    double p[3];
    set_numbers(p, point, "point");
    return ask<palpate_surface_hit>(contacts, [&](const palpate_contacts* of, palpate_step_flags* flags) {
      return scene_.closest_point(of, p, farthest, flags);
    });
  }
  py::object signed_distance(const Numbers& point, HeldContacts* contacts) {
    double p[3];
    set_numbers(p, point, "point");
    return ask<double>(contacts, [&](const palpate_contacts* of, palpate_step_flags* flags) {
      return scene_.signed_distance(of, p, flags);
    });
  }

  py::object report() {
    const InUse use(touching_, kTouching);
    const palpate_contact_report* report = palpate_scene_report(scene_.get());
    if (!report) throw py::value_error("the scene reports no contacts; make it with report=\"contacts\"");
    return py::make_tuple(py::array_t<palpate_contact>(report->contact_count, palpate_report_contact(report, 0)),
                          py::array_t<palpate_contact_event>(report->event_count, palpate_report_event(report, 0)));
  }
  py::bytes report_bytes() {
    const InUse use(touching_, kTouching);
    const palpate_contact_report* report = palpate_scene_report(scene_.get());
    if (!report) throw py::value_error("the scene reports no contacts; make it with report=\"contacts\"");
    return py::bytes(reinterpret_cast<const char*>(report), report->used_bytes);
  }
  void set_pose(const Numbers& position, const Numbers& orientation, const Numbers& velocity,
                const Numbers& angular_velocity) {
    const InUse use(touching_, kTouching);
    palpate_pose pose = palpate_default_pose();
    set_numbers(pose.position, position, "position");
    set_numbers(pose.orientation, orientation, "orientation");
    set_numbers(pose.velocity, velocity, "velocity");
    set_numbers(pose.angular_velocity, angular_velocity, "angular_velocity");
    palpate_error error = {};
    if (!scene_.set_pose(pose, &error)) throw Error(error);
  }

  void set_links(const py::iterable& links) {
    const InUse use(touching_, kTouching);
    link_copies_.take(links);
    palpate_error error = {};
    if (palpate_scene_set_links(scene_.get(), link_copies_.data(), link_copies_.count(), &error) != PALPATE_OK)
      throw Error(error);
  }
  py::array link_states() {
    const InUse use(touching_, kTouching);
    std::int32_t count = 0;
    while (palpate_scene_link_state(scene_.get(), count)) ++count;
    py::array_t<palpate_link_state> states(std::vector<py::ssize_t>{count});
    for (std::int32_t i = 0; i < count; ++i) states.mutable_data()[i] = *palpate_scene_link_state(scene_.get(), i);
    return states;
  }
  py::object grasp_state(std::int32_t id) {
    const InUse use(touching_, kTouching);
    const palpate_grasp_state* state = palpate_scene_grasp_state(scene_.get(), id);
    if (!state) return py::none();
    return py::array_t<palpate_grasp_state>(1, state)[py::int_(0)];
  }

  void reset() {
    const InUse use(touching_, kTouching);
    scene_.reset();
  }
  py::bytes save() {
    const InUse use(touching_, kTouching), deform_use(deforming_, kDeforming);
    State state;
    palpate_error error = {};
    if (scene_.save(state, &error) != PALPATE_OK) throw Error(error);
    return py::bytes(static_cast<const char*>(state.get()), state.bytes());
  }
  void restore(const py::buffer& data) {
    const HeldBuffer bytes(data);
    const InUse use(touching_, kTouching), deform_use(deforming_, kDeforming);
    State state(bytes.size());
    if (bytes.size() > 0) std::memcpy(state.get(), bytes.data(), bytes.size());
    palpate_error error = {};
    if (bytes.size() == 0)
      throw Error({PALPATE_ERROR_TRUNCATED, 0, "the state has no bytes; expected those that save returned"});
    if (scene_.restore(state, &error) != PALPATE_OK) throw Error(error);
  }
  void reset_tool(std::int32_t id) {
    const InUse use(touching_, kTouching);
    scene_.reset_tool(id);
  }

  std::int64_t most_operations() const { return palpate_scene_most_operations(scene_.get()); }

  std::vector<PlanPass> plan() const {
    std::vector<PlanPass> plan;
    while (const palpate_plan_pass* pass = palpate_scene_plan(scene_.get(), static_cast<std::int32_t>(plan.size())))
      plan.push_back({pass->name, pass->half, pass->sections, pass->mapped_bytes});
    return plan;
  }

 private:
  static constexpr const char *kTouching = "touch already runs on another thread",
                              *kDeforming = "deform already runs on another thread";

  static Scene create(const Bundle& bundle, const palpate_scene_def& def) {
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
    palpate_step_flags flags = 0;
    const Answer answer = without_lock([&] { return query(contacts ? contacts->contacts.get() : nullptr, &flags); });
    if (flags & (PALPATE_STEP_BAD_INPUT | PALPATE_STEP_OTHER_BUNDLE))
      throw py::value_error(
          def_.queries == PALPATE_QUERIES_OFF
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

  // The first number of a caller's array, which the step fills.
  static float* writable(const py::object& object, const char* name, std::int32_t rows) {
    if (object.is_none()) return nullptr;
    if (!py::isinstance<py::array_t<float>>(object))
      throw py::type_error(
          std::string(name) + ": expected a numpy array of float32; found " +
          std::string(py::str(py::type::of(object).attr("__name__"))) +
          (py::isinstance<py::array>(object) ? " of " + std::string(py::str(object.attr("dtype"))) : ""));
    auto array = py::reinterpret_borrow<py::array_t<float>>(object);
    if (array.ndim() != 2 || array.shape(1) != 3 || array.shape(0) < rows)
      throw py::value_error(std::string(name) + ": expected shape [" + std::to_string(rows) +
                            ", 3], or more rows; found " + std::string(py::str(array.attr("shape"))));
    if ((array.flags() & py::array::c_style) == 0 || !array.writeable() ||
        reinterpret_cast<std::uintptr_t>(array.data()) % alignof(float) != 0)
      throw py::value_error(std::string(name) + ": expected a contiguous array that may be written to");
    return array.mutable_data();
  }

  std::shared_ptr<HeldBundle> bundle_;  // outlives the scene
  palpate_scene_def def_;
  std::int32_t vertex_count_;  // of the render mesh
  Scene scene_;
  std::vector<std::uint64_t> report_copy_;  // of skin
  ToolCopies copies_;
  LinkCopies link_copies_;
  std::atomic_flag touching_ = ATOMIC_FLAG_INIT, deforming_ = ATOMIC_FLAG_INIT, shaping_ = ATOMIC_FLAG_INIT,
                   asking_ = ATOMIC_FLAG_INIT;
};

std::unique_ptr<HeldScene> make_scene(std::shared_ptr<HeldBundle> bundle, const std::string& collision,
                                      const std::string& contact, const std::string& law, const std::string& force,
                                      const std::string& shape, const std::string& radial, const std::string& preload,
                                      const std::string& queries, const std::string& deformation,
                                      const std::string& report, const std::string& dent, const py::object& relaxation,
                                      const py::object& render_mesh, const py::object& fine_surface,
                                      std::int32_t max_tools, std::int32_t max_points, std::int32_t max_contact_nodes,
                                      double force_limit, double force_slew, double max_tool_speed,
                                      double release_distance, double torque_limit, double torque_slew,
                                      std::int64_t max_operations, std::int32_t max_links, bool grasps) {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = choose<palpate_collision>("collision", collision, {"off", "rest", "deformed"});
  def.contact = choose<palpate_contact_model>("contact", contact, {"node", "triangle", "point", "patch"});
  def.law = choose<palpate_contact_law>("law", law, {"sticking", "sliding", "unilateral", "coulomb"});
  def.force = choose<palpate_force_model>("force", force, {"off", "linear", "response"});
  def.shape = choose<palpate_shape_model>("shape", shape, {"off", "surface", "volume"});
  def.radial = choose<palpate_radial_model>("radial", radial, {"off", "response"});
  def.preload = choose<palpate_preload_model>("preload", preload, {"off", "on"});
  def.queries = choose<palpate_query_model>("queries", queries, {"off", "on"});
  def.deformation = choose<palpate_deformation_model>("deformation", deformation,
                                                      {"linear", "large", "large-beside", "large-renewed"});
  def.report = choose<palpate_report_model>("report", report, {"off", "contacts"});
  def.dent = choose<palpate_dent_model>("dent", dent, {"off", "discs"});
  def.relaxation = relaxation_of(relaxation);
  std::optional<RenderMesh> mesh;
  if (!render_mesh.is_none()) def.render_mesh = &mesh.emplace(render_mesh).mesh;
  std::optional<FineSurface> fine;
  if (!fine_surface.is_none()) def.fine_surface = &fine.emplace(fine_surface).surface;
  def.max_tools = max_tools;
  def.max_points = max_points;
  def.max_contact_nodes = max_contact_nodes;
  def.force_limit = force_limit;
  def.force_slew = force_slew;
  def.max_tool_speed = max_tool_speed;
  def.release_distance = release_distance;
  def.torque_limit = torque_limit;
  def.torque_slew = torque_slew;
  def.max_operations = max_operations;
  def.max_links = max_links;
  def.grasps = grasps;
  return std::make_unique<HeldScene>(std::move(bundle), def);
}

void add_plan_pass(py::module_& module) {
  py::class_<PlanPass>(module, "PlanPass", "One pass of a scene's plan and the sections that it maps.")
      .def_readonly("name", &PlanPass::name, "\"collision: rest\", \"superposition: surface\", ...")
      .def_readonly("half", &PlanPass::half, "\"create\", \"touch\" or \"shape\"")
      .def_readonly("sections", &PlanPass::sections, "bundle sections that it reads")
      .def_readonly("mapped_bytes", &PlanPass::mapped_bytes, "of those sections")
      .def("__repr__", [](const PlanPass& self) {
        return "<palpate.PlanPass: " + self.half + ", " + self.name + ", " + self.sections + ">";
      });
}

void add_hit(py::module_& module) {
  const auto three = [](double(palpate_surface_hit::*member)[3]) {
    return [member](const palpate_surface_hit& self) { return py::array_t<double>(3, self.*member); };
  };
  py::class_<palpate_surface_hit>(module, "Hit", "A surface point that a query found.")
      .def_readonly("triangle", &palpate_surface_hit::triangle, "index of its triangle")
      .def_property_readonly("barycentric", three(&palpate_surface_hit::barycentric), "weights of its three vertices")
      .def_property_readonly("point", three(&palpate_surface_hit::point), "m")
      .def_property_readonly("normal", three(&palpate_surface_hit::normal), "outward unit normal of the triangle")
      .def_readonly("distance", &palpate_surface_hit::distance, "m")
      .def("__repr__", [](const palpate_surface_hit& self) {
        return "<palpate.Hit: triangle " + std::to_string(self.triangle) + ", " + std::to_string(self.distance) +
               " m away>";
      });
}

}  // namespace

void add_scene(py::module_& module) {
  const palpate_scene_def start = palpate_default_scene_def();
  add_plan_pass(module);
  add_hit(module);
  py::class_<HeldScene>(
      module, "Scene",
      "One organ under one set of effects. It keeps its bundle open. touch and shape run without the\n"
      "interpreter's lock, so one thread may touch while another draws. Each is for one thread at a time.")
      .def(py::init(&make_scene), py::arg("bundle"), py::kw_only(), py::arg("collision") = "rest",
           py::arg("contact") = "patch", py::arg("law") = "sticking", py::arg("force") = "linear",
           py::arg("shape") = "surface", py::arg("radial") = "off", py::arg("preload") = "off",
           py::arg("queries") = "off", py::arg("deformation") = "linear", py::arg("report") = "off",
           py::arg("dent") = "off", py::arg("relaxation") = py::none(), py::arg("render_mesh") = py::none(),
           py::arg("fine_surface") = py::none(), py::arg("max_tools") = start.max_tools,
           py::arg("max_points") = start.max_points, py::arg("max_contact_nodes") = start.max_contact_nodes,
           py::arg("force_limit") = start.force_limit, py::arg("force_slew") = start.force_slew,
           py::arg("max_tool_speed") = start.max_tool_speed, py::arg("release_distance") = start.release_distance,
           py::arg("torque_limit") = start.torque_limit, py::arg("torque_slew") = start.torque_slew,
           py::arg("max_operations") = start.max_operations, py::arg("max_links") = start.max_links,
           py::arg("grasps") = false,
           "Takes all memory and maps the sections that the effects need, and no other. Raises Error.\n\n"
           "collision: off, rest, deformed        contact: node, triangle, point, patch (a disc of the tool's "
           "disc_radius)\n"
           "law: sticking, sliding, unilateral, coulomb          force: off, linear, response\n"
           "shape: off, surface, volume           radial: off, response           preload: off, on\n"
           "queries: off, on (cast_ray, closest_point, signed_distance)          report: off, contacts\n"
           "dent: off, discs (skin sinks the render mesh to the discs of the report)\n"
           "deformation: linear, large (a hyperelastic body; the bundle must have been made for it)\n"
           "relaxation: None, or up to 8 pairs (share, seconds), the shares together below 1\n"
           "render_mesh: None, or a finer mesh that skin moves with the surface: positions [vertices, 3], m, or a "
           "tuple of\n"
           "positions and normals; read now and no longer\n"
           "fine_surface: None, or a closed surface that tools meet in place of the bundle's triangles: a tuple of "
           "positions\n"
           "[vertices, 3], m, and triangles [triangles, 3], counter-clockwise from outside; read now and no longer\n"
           "max_tools, max_points, max_contact_nodes: limits that memory is taken for\n"
           "force_limit, N; force_slew, N/s: on each tool's force, for a device; torque_limit, N m; torque_slew, N "
           "m/s: on its\n"
           "torque\n"
           "max_tool_speed, m/s; release_distance, m (0: from the organ's size): beyond them a point is TRACKING_LOST\n"
           "max_operations: counted operations of a touch; what does not fit is put off (WORK_DEFERRED)\n"
           "max_links: links that set_links may give; grasps: whether tools may have a Grasp (contact=\"patch\", "
           "deformation=\"linear\")")
      .def_property_readonly("bundle", &HeldScene::bundle, "the Bundle that it was made on")
      .def_property_readonly("shape_node_count", &HeldScene::shape_node_count,
                             "nodes that shape fills: the surface's, all (shape=\"volume\"), or 0")
      .def_property_readonly(
          "plan",
          [](const HeldScene& self) {
            py::list plan;
            for (PlanPass& pass : self.plan()) plan.append(std::move(pass));
            return plan;
          },
          "list of PlanPass, in the order that they run")
      .def_property_readonly("most_operations", &HeldScene::most_operations,
                             "that a touch may count, whatever the tools do")
      .def("make_contacts", &HeldScene::make_contacts, "Contacts of this scene's size.")
      .def("touch", &HeldScene::touch, py::arg("tools"), py::arg("dt"), py::arg("contacts"),
           "The haptic half: collision, contacts, forces. tools: of Tool, known by their id; dt: s since the last\n"
           "touch. Fills contacts and returns StepFlags; 0 is full trust. Microseconds.")
      .def("deform", &HeldScene::deform,
           "With deformation=\"large-beside\" or \"large-renewed\": solves the body under the contacts of the newest "
           "touch, a little "
           "further in\n"
           "each call, in a thread of its own. Returns the evaluations of the energy that it took; 0: nothing to do.\n"
           "Neither save nor restore the scene meanwhile.")
      .def(
          "shape", &HeldScene::shape, py::arg("contacts"), py::arg("positions") = py::none(),
          py::arg("displacements") = py::none(),
          "The render half: writes the deformed nodes into the caller's arrays, float32 [shape_node_count, 3] or more\n"
          "rows, contiguous, m; nothing is allocated. Returns StepFlags; 0 is full trust.")
      .def_property_readonly("vertex_count", &HeldScene::vertex_count, "vertices that skin fills: the render mesh's")
      .def("skin", &HeldScene::skin, py::arg("displacements"), py::arg("positions") = py::none(),
           py::arg("normals") = py::none(), py::arg("report") = py::none(), py::arg("disc_normals") = py::none(),
           "The render mesh under a shape: displacements as shape wrote them. Fills the caller's arrays, float32\n"
           "[vertex_count, 3] or more rows, contiguous; m. Returns StepFlags; 0 is full trust.\n"
           "report: report_bytes of the touch that made the shape; a scene with dent=\"discs\" then sinks the mesh to its\n"
           "discs. disc_normals: float32 [contacts of the report, 3]; filled with the unit normal of the plane that each "
           "disc is\n"
           "drawn in, through the contact's tool_point; zero: no disc. Rows beyond the contacts keep what they held.")
      .def("normals", &HeldScene::normals, py::arg("positions"), py::arg("normals"),
           "Normals of the surface's vertices, the mean of the triangles around each, weighted by their angles:\n"
           "positions as shape wrote them. Fills the caller's array, float32 [surface_node_count, 3]. Returns "
           "StepFlags.")
      .def("cast_ray", &HeldScene::cast_ray, py::arg("origin"), py::arg("direction"), py::arg("contacts") = py::none(),
           py::arg("longest") = INFINITY,
           "The first Hit of a ray with the surface as the contacts deform it, from outside or inside, or None.\n"
           "contacts: None for the surface at rest; longest: m along the ray. For one thread at a time, beside touch "
           "and shape.")
      .def("closest_point", &HeldScene::closest_point, py::arg("point"), py::arg("contacts") = py::none(),
           py::arg("farthest") = INFINITY, "The nearest point of that surface, if it is nearer than farthest, or None.")
      .def("signed_distance", &HeldScene::signed_distance, py::arg("point"), py::arg("contacts") = py::none(),
           "The distance of a point from that surface, m, below zero inside.")
      .def("report", &HeldScene::report,
           "Contacts and events of the last touch: two structured arrays, copies, with the fields of palpate_contact "
           "and\n"
           "palpate_contact_event. state: 0 sticks, 1 slips, 2 frictionless, 3 released. kind: 1 begin, 2 end, 3 slip "
           "start,\n"
           "4 stick start; of links 5 taut, 6 slack, 7 broke; of grasps 8 closed, 9 slips, 10 holds, 11 let go, 12 "
           "opened. "
           "Read it after every touch.")
      .def("report_bytes", &HeldScene::report_bytes, "The same report as bytes, a copy, for skin.")
      .def("set_pose", &HeldScene::set_pose, py::arg("position") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("orientation") = py::make_tuple(1.0, 0.0, 0.0, 0.0), py::kw_only(),
           py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("angular_velocity") = py::make_tuple(0.0, 0.0, 0.0),
           "Where the organ is in the world at the next touch: m; a quaternion w, x, y, z; m/s and rad/s, with which "
           "each\n"
           "later touch moves it on. Points of tools and forces on tools are in the world. Raises Error.")
      .def("set_links", &HeldScene::set_links, py::arg("links"),
           "Gives the scene its links, of Link, in place of those that it had; each later touch holds them. One that "
           "was "
           "there\n"
           "before with its id, kind and ends keeps its state, and takes its new numbers. Raises Error.")
      .def("link_states", &HeldScene::link_states,
           "After a touch: structured [links], a copy: id, condition (0 slack, 1 taut, 2 broken), broken (the touch), "
           "rest_length,\n"
           "length, tension (N), force ([3], N, on the first end), ends ([2, 3], m).")
      .def("grasp_state", &HeldScene::grasp_state, py::arg("id"),
           "After a touch, of the tool with that id: a record, a copy: condition (0 open, 1 holds, 2 slips, 3 let go), "
           "force (N)\n"
           "and torque (N m) on the tool, place (m), slipped (m), friction_limit (N); None where no tool has it.")
      .def("reset", &HeldScene::reset, "Forgets contacts, last positions and forces; the pose stays.")
      .def("save", &HeldScene::save,
           "bytes: what the touches have left in the scene. Restored, the next touches give the same bits.")
      .def(
          "restore", &HeldScene::restore, py::arg("state"),
          "Takes over the state of a scene with the same effects, limits and bundle. Raises Error where it is damaged\n"
          "or of another scene, which leaves this one as it was.")
      .def("reset_tool", &HeldScene::reset_tool, py::arg("id"),
           "The same for the tool of that id alone; an id that is not in use changes nothing.");
}

}  // namespace palpate::python
