// The organ as the elements need it: coordinates in metres, surface nodes first, a material for each region, which dofs
// are held, what supports it softly and which nodes may be touched. A dof (degree of freedom) is the displacement of one node along x, y or z.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "formats/bundle_layout.h"
#include "formats/organ_config.h"
#include "formats/tetrahedral_mesh.h"
#include "precompute/elements/supports.h"

namespace palpate {

struct Material {
  double young = 0;    // Pa
  double poisson = 0;  // -1 < nu < 0.5
  double density = 0;  // kg/m^3; 0: not given
};

// What moves the organ from outside, in units of formats::MotionKind. Of a gravity each axis is one of these.
struct Motion {
  std::string name;
  formats::MotionKind kind{};
  std::array<double, 3> axis{}, point{};     // piston, rotation, gravity: of length 1; rotation: m
  std::vector<char> moves{};                 // piston, rotation, field: per node, 1 where its support moves
  std::vector<std::array<double, 3>> way{};  // field: per node, m
  std::vector<std::int32_t> triangles{};     // pressure: of ElasticBody::triangles, ascending
};

// A capsule around the segment from - to, m.
struct PlacedCorridor {
  std::string name;
  std::array<double, 3> from{}, to{};
  double radius = 0;
  std::vector<std::int32_t> nodes;  // those inside the body of every tetrahedron within the radius, ascending
};

// Order of the nodes: first those of the outer surface, then the others; both groups in the order of the mesh file. With [cut] the nodes inside on
// which a cut acts and its reserve stand between the two, and count as nodes of the surface: they may become such.
// Tetrahedra keep the order of the file.
struct ElasticBody {
  std::vector<std::array<double, 3>> nodes;  // m
  std::int32_t surface_count = 0;            // nodes 0 .. surface_count - 1 are on the surface
  std::vector<std::array<std::int32_t, 4>> tetrahedra;
  std::vector<std::int32_t> region;  // per tetrahedron, index into materials
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<Material> materials;
  std::vector<std::string> region_names;
  std::vector<std::array<std::uint8_t, 3>> fixed;  // per node: 1 where x, y or z is held at zero
  std::vector<Foundation> foundations;             // soft supports; a node on one of them has free dofs
  std::vector<SpringSet> springs;
  std::vector<Motion> motions;
  std::vector<PlacedCorridor> corridors;
  std::vector<std::int32_t> corridor_nodes;  // of all corridors, ascending, each >= surface_count; held ones too
  std::size_t cut_dividable = 0;             // nodes that a cut at run time may divide
  std::vector<std::int32_t> cut_nodes;  // those on which it may act, ascending, each < surface_count; held ones too
  std::int32_t reserve = 0;             // the last ones below surface_count, in no tetrahedron: new nodes of a cut
  std::vector<std::int32_t> touchable;  // ascending, each < surface_count, each with a free dof
};

// Named in error messages.
struct BodyFiles {
  std::filesystem::path mesh, organ, boundary;
  std::filesystem::path image = {};  // read where a `label` selector names no image of its own; may be empty
};
// Errors: InputError where mesh, organ and boundary contradict one another, where nothing may be touched, and where the
// coordinates cannot be those of an organ in metres.
ElasticBody make_elastic_body(const TetrahedralMesh& mesh, const OrganConfig& organ, const BoundaryConfig& boundary,
                              const BodyFiles& files);

}  // namespace palpate
