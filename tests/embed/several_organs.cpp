// Two organs and one tool that presses on one after the other, as docs/embedding.md shows.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <palpate/palpate.hpp>

namespace {

int play(const char* file) {
  const palpate::Bundle bundle(file);
  palpate_pose beside = palpate_default_pose();
  beside.position[0] = 0.2;
  palpate_world_organ organs[2] = {palpate_default_world_organ(), palpate_default_world_organ()};
  organs[0].bundle = organs[1].bundle = bundle.get();  // two organs may stand on one bundle
  organs[1].pose = &beside;
  palpate_world_def def = palpate_default_world_def();
  def.organs = organs, def.organ_count = 2;
  palpate::World world(def);
  palpate::WorldContacts contacts = world.make_contacts();

  // The box around an organ.
  double low[3] = {1e9, 1e9, 1e9}, high[3] = {-1e9, -1e9, -1e9};
  for (std::int32_t i = 0; i < 3 * bundle.describe().node_count; ++i)
    low[i % 3] = std::min(low[i % 3], bundle.nodes()[i]), high[i % 3] = std::max(high[i % 3], bundle.nodes()[i]);

  double most[2] = {0, 0};
  for (int step = 0; step < 200; ++step) {
    // Through the middle of the organ's last face along x: first into organ 0, then into organ 1.
    const int organ = step / 100;
    const double depth = 2e-5 * (step % 100) - 1e-4;
    const double point[3] = {high[0] + 0.2 * organ - depth, 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])};
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = 0.002;
    world.touch(&tool, 1, 1e-3, contacts);
    const double* f = contacts.state(organ).force;
    most[organ] = std::fmax(most[organ], std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]));
  }
  std::printf("largest force on organ 0: %.4f N, on organ 1: %.4f N\n", most[0], most[1]);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: several_organs BUNDLE.h5\n"), 2;
  try {
    return play(argv[1]);
  } catch (const palpate::Error& error) {
    return std::fprintf(stderr, "several_organs: %s\n", error.what()), 1;
  }
}
