// without_exceptions BUNDLE.h5: palpate.hpp in a host that is compiled with -fno-exceptions -fno-rtti. What fails returns an empty
// owner and fills the error.
#include <palpate/palpate.hpp>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <type_traits>

#ifdef __cpp_exceptions
#error "compile this file with -fno-exceptions"
#endif
// What would throw is not there; what returns is.
static_assert(!std::is_constructible_v<palpate::Bundle, const char*>);
static_assert(!std::is_constructible_v<palpate::Bundle, const void*, std::size_t>);
static_assert(!std::is_constructible_v<palpate::Scene, const palpate::Bundle&>);
static_assert(!std::is_constructible_v<palpate::Coupling, const palpate_device&>);
static_assert(!std::is_constructible_v<palpate::PassivityObserver, const palpate_device&>);
static_assert(!std::is_constructible_v<palpate::Watchdog, const palpate_watchdog_def&>);
static_assert(noexcept(palpate::Bundle::open_file("", nullptr)) && noexcept(palpate::Bundle::open("", 0, nullptr)));

namespace {
int failures = 0;
void expect(bool holds, const char* what) {
  if (!holds) std::printf("failed: %s\n", what), ++failures;
}

void expect_plan(palpate::Scene& scene) {
  const palpate::PlanPasses plan = scene.plan();
  std::int32_t passes = 0, touches = 0;
  for (const palpate_plan_pass& pass : plan) ++passes, touches += std::strcmp(pass.half, "touch") == 0;
  expect(passes == plan.size() && passes > 2 && touches > 0, "the plan is a range of passes");
  expect(&plan[1] == palpate_scene_plan(scene.get(), 1) && plan.begin()->name == plan[0].name,
         "and each can be asked for");
  expect(palpate::PlanPasses().begin() == palpate::PlanPasses().end(), "an empty plan has none");
  const auto is_counted = [](const palpate_plan_pass& pass) { return pass.most_operations > 0; };
  expect(std::any_of(plan.begin(), plan.end(), is_counted), "a pass says what it may count");
  expect(scene.most_operations() >= palpate::SceneDef().max_operations, "and so does the whole step");
  expect(palpate::operations_in(300) > 0 && palpate::operations_in(-1) == 0, "and the machine what it counts");

  palpate_step_load load = palpate_default_step_load();
  load.contacts = load.points = load.tools = 1, load.rows = 3, load.nodes = 8;
  double steps = 0;
  for (std::int32_t pass = 0; pass < plan.size(); ++pass) steps += scene.predict_pass(pass, load).steps;
  expect(steps > 0, "a touch of one point has a predicted cost");

  std::int32_t watched = 0;
  palpate::Contacts contacts = scene.make_contacts();
  scene.watch_passes([](void* user, std::int32_t) { ++*static_cast<std::int32_t*>(user); }, &watched);
  scene.touch(nullptr, 0, 0.001, contacts);
  const std::int32_t seen = watched;
  scene.watch_passes(nullptr);
  scene.touch(nullptr, 0, 0.001, contacts);
  expect(seen > 0 && watched == seen, "passes are watched until nobody watches");
}

// A grip holds a node, moves on, and goes.
void expect_report(const palpate::Bundle& bundle, std::int32_t node) {
  palpate_error error = {};
  palpate::SceneDef def;
  expect(!palpate::Scene::create(bundle, def, &error).report(), "a scene without a report has none");
  expect(palpate::Report().contacts().empty() && palpate::Report().events().empty(), "and an empty one is empty");
  def.report.report = PALPATE_REPORT_CONTACTS;
  palpate::Scene scene = palpate::Scene::create(bundle, def, &error);
  palpate::Contacts contacts = scene.make_contacts();
  palpate_grip grips[2] = {palpate_default_grip(), palpate_default_grip()};
  for (palpate_grip& grip : grips) grip.kind = PALPATE_GRIP_NODE, grip.displacement[2] = 1e-4;
  grips[0].node = node, grips[1].node = bundle.touchable()[1];
  palpate_tool tool = palpate_default_tool();
  tool.id = 7, tool.grips = grips, tool.grip_count = 2;
  scene.touch(&tool, 1, 0.001, contacts);
  const palpate::Report report = scene.report();
  expect(report && report->step == 1 && report.contacts().size() == 2, "the report has both grips");
  std::int32_t point = 0;
  for (const palpate_contact& contact : report.contacts())
    expect(contact.tool_id == 7 && contact.node == grips[point].node && contact.point == point, "one by one"), ++point;
  expect(point == 2 && &report.contacts()[1] == palpate_report_contact(report.get(), 1), "in their order");
  const palpate::Elements<palpate_contact_event> begun = report.events();
  const auto is_begin = [](const palpate_contact_event& event) { return event.kind == PALPATE_EVENT_BEGIN; };
  expect(begun.size() == 2 && std::count_if(begun.begin(), begun.end(), is_begin) == 2, "and says that they began");

  tool.grip_count = 1;
  scene.touch(&tool, 1, 0.001, contacts);
  expect(scene.report().contacts().size() == 1 && scene.report().events().size() == 1, "one of them goes");
  expect(scene.report().events()[0].kind == PALPATE_EVENT_END && scene.report().events()[0].point == 1,
         "and the report says which one");

  palpate_world_organ organ = palpate_default_world_organ();
  organ.bundle = bundle.get(), organ.def = &def;
  palpate_world_def world_def = palpate_default_world_def();
  world_def.organs = &organ, world_def.organ_count = 1;
  palpate::World world = palpate::World::create(world_def, &error);
  palpate::WorldContacts of_world = world.make_contacts();
  world.touch(&tool, 1, 0.001, of_world);
  expect(world.report(0).contacts().size() == 1 && !world.report(1), "an organ of a world has a report");
}

void expect_device_help() {
  palpate_error error = {};
  palpate_device device = palpate_default_device();
  expect(!palpate::Coupling::create(device, &error) && error.status == PALPATE_ERROR_ARGUMENT,
         "a device without a mass gets no coupling");
  expect(!palpate::PassivityObserver::create(device, &error) && error.text[0], "and no observer");
  device.mass = 0.1, device.damping = 0.5;
  palpate::Coupling coupling = palpate::Coupling::create(device, &error);
  expect(coupling && coupling->stiffness > 0, "a known one gets a coupling");
  expect(palpate::required_damping(coupling->stiffness, coupling->damping, device.tick, device.delay_ticks) <=
             device.damping,
         "which needs no more than its damping");
  palpate::PassivityObserver observer = palpate::PassivityObserver::create(device, &error);
  palpate_watchdog_def def = palpate_default_watchdog_def();
  palpate::Watchdog watchdog = palpate::Watchdog::create(def, &error);
  expect(observer && watchdog, "and an observer and a watchdog");

  // The handle goes 1 mm along z; the organ pushes back with 1 N.
  double at[3] = {0, 0, 0}, tool[3], sent[3], organ[3] = {0, 0, 1};
  for (int tick = 0; tick < 10; ++tick) {
    at[2] = -1e-4 * tick;
    expect(coupling.step(at, organ, tool, sent) == 0, "a step has nothing to report");
    expect(watchdog.step(static_cast<std::uint64_t>(tick) + 1, sent, device.tick, sent) <= PALPATE_DEVICE_SILENT,
           "nor has the watchdog");
    observer.step(at, sent, coupling->energy, sent);
  }
  expect(tool[2] > at[2] && sent[2] > 0 && observer->held_force[0][2] == sent[2],
         "the tool stays behind, and the device feels it");
  const palpate::Coupling saved = coupling;
  coupling.reset();
  expect(coupling.step(at, organ, tool, sent) == 0 && tool[2] == at[2] && sent[2] == 0, "a reset coupling is at rest");
  expect(saved->device_force[2] > 0, "and its copy is not");

  const double late[3] = {0, 0, 1};
  palpate_device_flags flags = 0;
  for (int tick = 0; tick < 200; ++tick) flags |= watchdog.step(10, late, device.tick, sent);
  expect(flags & PALPATE_DEVICE_SILENT && sent[2] == 0, "silence lets the force go");
  def.timeout = 0;
  expect(!palpate::Watchdog::create(def, &error) && error.status == PALPATE_ERROR_ARGUMENT, "no watchdog without time");

  sent[2] = 1;
  expect(palpate::Watchdog().step(1, sent, device.tick, sent) == PALPATE_DEVICE_BAD_INPUT && sent[2] == 0,
         "an empty watchdog sends nothing");
  sent[2] = 1;
  expect(palpate::PassivityObserver().step(at, sent, 0, sent) == PALPATE_DEVICE_BAD_INPUT && sent[2] == 0,
         "nor does an empty observer");
  sent[2] = 1;
  expect(
      palpate::Coupling().step(at, organ, tool, sent) == PALPATE_DEVICE_BAD_INPUT && sent[2] == 0 && tool[2] == at[2],
      "nor an empty coupling");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  palpate_error error = {};
  const palpate::Bundle absent = palpate::Bundle::open_file("there-is-no-such-file.h5", &error);
  expect(!absent, "a missing file gives an empty bundle");
  expect(error.status == PALPATE_ERROR_FILE && std::strstr(error.text, "it does not exist"),
         "and says that it is missing");

  alignas(64) const unsigned char zeros[4096] = {};
  expect(!palpate::Bundle::open(zeros, sizeof zeros, &error), "zeros give an empty bundle");
  expect(error.status == PALPATE_ERROR_MAGIC, "and say that they are no bundle");

  const palpate::Bundle bundle = palpate::Bundle::open_file(argv[1], &error);
  expect(bundle && error.status == PALPATE_OK, "the bundle opens");
  palpate::SceneDef def;
  def.max_tools = 0;
  expect(!palpate::Scene::create(bundle, def, &error), "a scene for no tools is empty");
  expect(error.status == PALPATE_ERROR_ARGUMENT && error.text[0], "and says why");

  def = palpate::SceneDef();
  palpate::Scene scene;
  expect(!scene, "a scene that was not created is empty");
  scene = palpate::Scene::create(bundle, def, &error);
  expect(scene && error.status == PALPATE_OK, "a scene is created");
  palpate::Contacts contacts = scene.make_contacts();
  expect(scene.touch(nullptr, 0, 0.001, contacts) == 0 && contacts->step == 1, "and steps");

  // A ligament between a touchable node's triangle and a point 5 cm beside it.
  def.links.max_links = 1, def.grasps.grasps = 1;
  scene = palpate::Scene::create(bundle, def, &error);
  palpate::Contacts held = scene.make_contacts();
  palpate_link link = palpate_default_link();
  expect(scene.set_links(&link, 1, &error) == PALPATE_ERROR_ARGUMENT && std::strstr(error.text, "expected a kind"),
         "a link that says nothing is refused");
  link.kind = PALPATE_LINK_THREAD, link.stiffness = 10;
  link.ends[0].kind = PALPATE_END_SURFACE_POINT, link.ends[1].kind = PALPATE_END_WORLD;
  const std::int32_t node = palpate_bundle_touchable(bundle.get())[0];
  const std::int32_t* corner = palpate_bundle_triangles(bundle.get());
  while (*corner != node) ++corner;
  const std::ptrdiff_t at = corner - palpate_bundle_triangles(bundle.get());
  link.ends[0].triangle = static_cast<std::int32_t>(at / 3), link.ends[0].barycentric[at % 3] = 1;
  for (int d = 0; d < 3; ++d)
    link.ends[1].point[d] = palpate_bundle_nodes(bundle.get())[3 * node + d] + (d == 0 ? 0.05 : 0);
  expect(scene.set_links(&link, 1, &error) == PALPATE_OK, "and a good one taken");
  for (int step = 0; step < 3; ++step) scene.touch(nullptr, 0, 0.001, held);
  expect(scene.link_state(0) && scene.link_state(0)->tension > 0 && !scene.link_state(1), "which then pulls");
  expect(!scene.grasp_state(0), "no tool grasps");
  expect_plan(scene);
  expect_report(bundle, node);
  expect_device_help();
  return failures == 0 ? 0 : 1;
}
