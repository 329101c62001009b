#include "tests/support/msh_files.h"

namespace palpate::tests {

std::string exact(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", x);
  return text;
}

std::string msh_names(const TetrahedralMesh& mesh) {
  std::string out = "$PhysicalNames\n";
  put_line(out, mesh.patches.size() + mesh.region_names.size());
  const auto quoted = [](std::string name) { return name.insert(0, 1, '"').append(1, '"'); };
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) put_line(out, 2, p + 1, quoted(mesh.patches[p].name));
  for (std::size_t r = 0; r < mesh.region_names.size(); ++r) put_line(out, 3, r + 1, quoted(mesh.region_names[r]));
  return out.append("$EndPhysicalNames\n");
}

std::size_t msh_element_count(const TetrahedralMesh& mesh) {
  std::size_t count = mesh.tetrahedra.size();
  for (const auto& patch : mesh.patches) count += patch.triangles.size();
  return count;
}

std::string msh2_ascii(const TetrahedralMesh& mesh) {
  std::string out = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  out.append(msh_names(mesh)).append("$Nodes\n");
  put_line(out, mesh.nodes.size());
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    put_line(out, n + 1, exact(mesh.nodes[n][0]), exact(mesh.nodes[n][1]), exact(mesh.nodes[n][2]));
  out.append("$EndNodes\n$Elements\n");
  put_line(out, msh_element_count(mesh));
  std::size_t tag = 0;
  for (std::size_t p = 0; p < mesh.patches.size(); ++p)
    for (const auto& t : mesh.patches[p].triangles)
      put_line(out, ++tag, 2, 2, p + 1, p + 1, t[0] + 1, t[1] + 1, t[2] + 1);
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    const auto& t = mesh.tetrahedra[e];
    const int region = mesh.region[e] + 1;
    put_line(out, ++tag, 4, 2, region, region, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
  }
  return out.append("$EndElements\n");
}

std::string msh2_binary(const TetrahedralMesh& mesh) {
  std::string out = "$MeshFormat\n2.2 1 8\n";
  put_raw<std::int32_t>(out, 1);
  out.append("\n$EndMeshFormat\n").append(msh_names(mesh)).append("$Nodes\n");
  put_line(out, mesh.nodes.size());
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    put_raw(out, static_cast<std::int32_t>(n + 1));
    for (const double x : mesh.nodes[n]) put_raw(out, x);
  }
  out.append("\n$EndNodes\n$Elements\n");
  put_line(out, msh_element_count(mesh));
  std::int32_t tag = 0;
  // Type, number of elements, tags of each; then the number, tags and nodes of each element.
  const auto group = [&](std::int32_t type, std::size_t count) {
    for (const std::int32_t word : {type, static_cast<std::int32_t>(count), 2}) put_raw(out, word);
  };
  const auto element = [&](std::int32_t physical, const auto& nodes) {
    for (const std::int32_t word : {++tag, physical, physical}) put_raw(out, word);
    for (const auto n : nodes) put_raw<std::int32_t>(out, n + 1);
  };
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    group(2, mesh.patches[p].triangles.size());
    for (const auto& t : mesh.patches[p].triangles) element(static_cast<std::int32_t>(p + 1), t);
  }
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    group(4, 1);
    element(mesh.region[e] + 1, mesh.tetrahedra[e]);
  }
  return out + "\n$EndElements\n";
}

std::string msh4_binary(const TetrahedralMesh& mesh) {
  std::string out = "$MeshFormat\n4.1 1 8\n";
  put_raw<std::int32_t>(out, 1);
  out.append("\n$EndMeshFormat\n").append(msh_names(mesh)).append("$Entities\n");
  const std::uint64_t regions = mesh.region_names.size(), patches = mesh.patches.size(), n = mesh.nodes.size();
  for (const std::uint64_t count : {std::uint64_t{0}, std::uint64_t{0}, patches, regions}) put_raw(out, count);
  const auto entity = [&](std::int32_t tag) {
    put_raw(out, tag);
    for (int d = 0; d < 6; ++d) put_raw(out, 0.0);
    put_raw<std::uint64_t>(out, 1);
    put_raw(out, tag);
    put_raw<std::uint64_t>(out, 0);
  };
  for (std::uint64_t p = 1; p <= patches; ++p) entity(static_cast<std::int32_t>(p));
  for (std::uint64_t r = 1; r <= regions; ++r) entity(static_cast<std::int32_t>(r));

  const auto number = [&](std::uint64_t node) { return 1000 + n - node; };
  out += "\n$EndEntities\n$Nodes\n";
  for (const std::uint64_t count : {std::uint64_t{1}, n, std::uint64_t{1001}, 1000 + n}) put_raw(out, count);
  for (const std::int32_t word : {3, 1, 0}) put_raw(out, word);
  put_raw(out, n);
  for (std::uint64_t i = 0; i < n; ++i) put_raw(out, number(i));
  for (const auto& p : mesh.nodes)
    for (const double x : p) put_raw(out, x);

  out += "\n$EndNodes\n$Elements\n";
  std::uint64_t tag = 0, total = msh_element_count(mesh);
  for (const std::uint64_t count : {patches + mesh.tetrahedra.size(), total, std::uint64_t{1}, total})
    put_raw(out, count);
  const auto block = [&](std::int32_t dimension, std::int32_t entity_tag, std::int32_t type, std::uint64_t count) {
    for (const std::int32_t word : {dimension, entity_tag, type}) put_raw(out, word);
    put_raw(out, count);
  };
  const auto element = [&](const auto& nodes) {
    put_raw(out, ++tag);
    for (const auto node : nodes) put_raw(out, number(static_cast<std::uint64_t>(node)));
  };
  for (std::uint64_t p = 0; p < patches; ++p) {
    block(2, static_cast<std::int32_t>(p + 1), 2, mesh.patches[p].triangles.size());
    for (const auto& t : mesh.patches[p].triangles) element(t);
  }
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    block(3, mesh.region[e] + 1, 4, 1);
    element(mesh.tetrahedra[e]);
  }
  return out + "\n$EndElements\n";
}

}  // namespace palpate::tests
