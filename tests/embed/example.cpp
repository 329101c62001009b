#include <cmath>
#include <cstdio>
#include <palpate/palpate.hpp>

int main(int argc, char** argv) try {
  palpate::Bundle bundle(argc == 2 ? argv[1] : "liver.h5");
  palpate::Scene scene(bundle);
  palpate::Contacts contacts = scene.make_contacts();

  // A disc of 2 mm radius meets the middle of a triangle, along its normal: 10 mm/s, from 5 mm above the surface to 5 mm below.
  const std::int32_t *t = bundle.triangles(), k = bundle.touchable()[0];
  while (t[0] != k && t[1] != k && t[2] != k) t += 3;
  const double *a = bundle.nodes() + 3 * t[0], *b = bundle.nodes() + 3 * t[1], *c = bundle.nodes() + 3 * t[2];
  double n[3], length = 0;
  for (int d = 0, e = 1, f = 2; d < 3; e = f, f = d++)
    n[d] = (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]), length += n[d] * n[d];
  for (int ms = 0; ms <= 1000; ++ms) {
    double point[3], force = 0;
    for (int d = 0; d < 3; ++d) point[d] = (a[d] + b[d] + c[d]) / 3 + n[d] / std::sqrt(length) * (0.005 - 1e-5 * ms);
    palpate_tool probe = palpate_default_tool();
    probe.points = point, probe.point_count = 1, probe.disc_radius = 0.002;
    scene.touch(&probe, 1, 0.001, contacts);
    for (int d = 0; d < 3; ++d) force += contacts.tool(0).force[d] * n[d] / std::sqrt(length);
    if (ms % 100 == 0) std::printf("%4d ms  %7.4f N\n", ms, force);
  }

  std::vector<float> positions(3 * bundle.describe().surface_node_count);
  palpate_shape_out shape = palpate_default_shape_out();
  shape.positions = positions.data(), shape.node_capacity = bundle.describe().surface_node_count;
  scene.shape(contacts, shape);
} catch (const palpate::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
