// write_recorded_run FOLDER: writes the path of the recorded run, its bundle, and the bundle in each packed form with a
// shorter path.
#include "tests/runtime/recorded_input.h"
#include "tests/support/packed_bundle.h"

int main(int argc, char** argv) {
  using namespace palpate::tests;
  if (argc != 2) return 2;
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  std::vector<RecordedStep> path = recorded_path();
  write_path(folder / "path", path);
  path.resize(80);  // an emulator is slow
  write_path(folder / "short-path", path);
  write_recorded_bundle(folder / "f32 rows.h5");
  for (const auto& [name, form] : kPackedForms) write_recorded_bundle(folder / (std::string(name) + ".h5"), form);
}
