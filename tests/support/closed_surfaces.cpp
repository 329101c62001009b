#include "tests/support/closed_surfaces.h"

namespace palpate::tests {

TriangleSurface box_surface(int n, Point low, Point high) {
  TriangleSurface box;
  std::map<std::array<int, 3>, std::int32_t> number;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [found, fresh] = number.emplace(at, static_cast<std::int32_t>(box.points.size()));
    if (fresh) {
      Point p{};
      for (int d = 0; d < 3; ++d) p[d] = low[d] + (high[d] - low[d]) * at[d] / n;
      box.points.push_back(p);
    }
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> at{};
            at[axis] = side * n;
            at[(axis + 1) % 3] = i + di;
            at[(axis + 2) % 3] = j + dj;
            return vertex(at);
          };
          std::int32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side == 0) std::swap(b, d);
          box.triangles.push_back({a, b, c});
          box.triangles.push_back({a, c, d});
        }
  return box;
}

void turn_inside_out(TriangleSurface& surface) {
  for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
}

void append(TriangleSurface& surface, const TriangleSurface& other) {
  const auto first = static_cast<std::int32_t>(surface.points.size());
  surface.points.insert(surface.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles) surface.triangles.push_back({a + first, b + first, c + first});
}

void write_off(const std::string& file, const TriangleSurface& surface) {
  std::ofstream out(file);
  out.precision(17);
  out << "OFF\n" << surface.points.size() << ' ' << surface.triangles.size() << " 0\n";
  for (const auto& [x, y, z] : surface.points) out << x << ' ' << y << ' ' << z << '\n';
  for (const auto& [a, b, c] : surface.triangles) out << "3 " << a << ' ' << b << ' ' << c << '\n';
}

}  // namespace palpate::tests
