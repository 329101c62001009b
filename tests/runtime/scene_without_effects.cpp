// A host that names no effect: it makes its scene by create_scene() with an empty list. check_linked_effects.py looks at what the linker
// took. Ends with 0 where a tool that presses the box feels a force.
#include <cstdio>
#include <filesystem>

#include "runtime/scene/build_scene.h"
#include "tests/support/file_bytes.h"
#include "tests/support/open_bundle.h"
#include "tests/support/tiny_bundle.h"

namespace palpate::tests {
namespace {

int press_box(const std::filesystem::path& file) {
  const TinyBox box;
  write_bundle(file, tiny_bundle(box));
  AlignedBytes bytes(file_bytes(file));
  std::filesystem::remove(file);
  palpate_bundle* opened = nullptr;
  palpate_scene* created = nullptr;
  palpate_error error = {};
  palpate_scene_def def = palpate_default_scene_def();
  if (palpate_bundle_open(bytes.data(), bytes.size(), nullptr, &opened, &error) != PALPATE_OK ||
      create_scene(opened, &def, {}, {}, &created, &error) != PALPATE_OK) {
    std::fprintf(stderr, "%s\n", error.text);
    return 1;
  }
  const BundlePointer bundle(opened);
  const ScenePointer scene(created);
  const std::size_t size = palpate_contacts_bytes(created);
  AlignedBytes of_contacts(std::string(size, '\0'));
  auto* const contacts = reinterpret_cast<palpate_contacts*>(of_contacts.data());
  // Into the face that looks along +x, 2 mm deep.
  for (int step = 0; step <= 40; ++step) {
    const double point[3] = {box.size[0] + 0.002 - 1e-4 * step, 0.024, 0.021};
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = 0.004;
    palpate_scene_touch(created, &tool, 1, 1e-3, contacts, size);
  }
  return palpate_contacts_tool(contacts, 0)->force[0] > 0 ? 0 : 1;
}

}  // namespace
}  // namespace palpate::tests

int main(int count, char** arguments) {
  return count == 2 ? palpate::tests::press_box(arguments[1]) : 2;
}
