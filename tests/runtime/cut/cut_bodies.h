// Bodies to be cut, and the rules that a cut body keeps, checked without the code of runtime/cut.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "runtime/cut/cut_mesh.h"

namespace palpate::tests {

struct BodyToCut {
  std::vector<double> nodes;
  std::vector<std::int32_t> tetrahedra, triangles;
  std::vector<std::uint8_t> held, dividable;
  std::vector<Mat3> support;  // of the triangles

  CutBody view() const;
  std::int32_t node_count() const { return static_cast<std::int32_t>(nodes.size() / 3); }
  std::int32_t tetrahedron_count() const { return static_cast<std::int32_t>(tetrahedra.size() / 4); }
  // The faces between two tetrahedra, each as the first of them has it.
  std::vector<std::int32_t> inner_faces() const;
};

// Makes the surface of the tetrahedra.
BodyToCut body_of(std::vector<double> nodes, std::vector<std::int32_t> tetrahedra);
// Cells of 1 m from (0, 0, 0) on, six tetrahedra each; nodes inside and on the sides are moved by at most `jitter` along each axis.
BodyToCut block_to_cut(int nx, int ny, int nz, double jitter, std::uint64_t seed);
// The same with a node in the middle of each cell, and four tetrahedra around the line between two of them.
BodyToCut lattice_to_cut(int nx, int ny, int nz, double jitter, std::uint64_t seed);
// Eight tetrahedra around a node inside.
BodyToCut octahedron();

// A cut mesh with its memory. positions: of its nodes, as the test moves them; new nodes begin where the ones are from which they come.
struct CutPlay {
  explicit CutPlay(const BodyToCut& body, std::int32_t reserve = 1 << 14);
  ~CutPlay() { memory.release_all(); }
  CutPlay(const CutPlay&) = delete;
  CutPlay& operator=(const CutPlay&) = delete;
  // One step of a blade with two points.
  const CutMeshChange& sweep(const std::array<double, 6>& from, const std::array<double, 6>& to);
  void follow();

  const BodyToCut& body;
  SceneMemory memory{palpate_allocator{}};
  CutMesh mesh;
  std::vector<double> positions;
};

// Of the body without these faces between tetrahedra, and without these tetrahedra: what is wrong with its surface; empty: nothing.
std::string fault_of(const BodyToCut& body, const std::set<std::int32_t>& cut, const std::set<std::int32_t>& removed);
// What is wrong with the mesh: its nodes, surface, triangles and pieces; empty: nothing.
std::string fault_of(const CutPlay& play);

// Steps of a blade that turns and moves at random through a body which opens, with cuts that cross, balls that are removed, pauses.
struct RandomCuts {
  explicit RandomCuts(std::uint64_t seed);
  // Plays one step. The sentence of a fault; empty: none.
  std::string step();
  BodyToCut body;
  CutPlay play;
  std::mt19937_64 random;
  std::array<double, 6> blade{};
  std::array<double, 3> velocity{};
  int left = 0;
  long cut_faces = 0, removed = 0, severed = 0, full = 0;

 private:
  void begin_stroke();
  void open();
};

}  // namespace palpate::tests
