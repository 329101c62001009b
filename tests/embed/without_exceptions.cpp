// without_exceptions BUNDLE.h5: palpate.hpp in a host that is compiled with -fno-exceptions -fno-rtti. What fails returns an empty
// owner and fills the error.
#include <palpate/palpate.hpp>

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
static_assert(noexcept(palpate::Bundle::open_file("", nullptr)) && noexcept(palpate::Bundle::open("", 0, nullptr)));

namespace {
int failures = 0;
void expect(bool holds, const char* what) {
  if (!holds) std::printf("failed: %s\n", what), ++failures;
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
  palpate_scene_def def = palpate_default_scene_def();
  def.max_tools = 0;
  expect(!palpate::Scene::create(bundle, def, &error), "a scene for no tools is empty");
  expect(error.status == PALPATE_ERROR_ARGUMENT && error.text[0], "and says why");

  def = palpate_default_scene_def();
  palpate::Scene scene;
  expect(!scene, "a scene that was not created is empty");
  scene = palpate::Scene::create(bundle, def, &error);
  expect(scene && error.status == PALPATE_OK, "a scene is created");
  palpate::Contacts contacts = scene.make_contacts();
  expect(scene.touch(nullptr, 0, 0.001, contacts) == 0 && contacts->step == 1, "and steps");

  // A ligament between a touchable node's triangle and a point 5 cm beside it.
  def.max_links = 1, def.grasps = 1;
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
  return failures == 0 ? 0 : 1;
}
