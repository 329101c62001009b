// Writes a body as CalculiX input and runs CalculiX on it: an independent solution of the same discrete problem.
#pragma once

#include <fmt/os.h>

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "precompute/elements/elastic_body.h"

namespace palpate::accuracy {

// Nodes (set ALL), elements with their materials, what is held. cells: four corners each (C3D4), or ten nodes in
// CalculiX's order, which is quadratic_tetrahedra.h's (C3D10). material: the lines after *MATERIAL.
struct CalculixModel {
  std::span<const std::array<double, 3>> nodes;                // m
  std::span<const std::array<std::uint8_t, 3>> fixed;          // [nodes]
  std::vector<std::vector<std::int32_t>> cells;                // the body's tetrahedra, in their order
  std::function<std::string(const Material& material)> words;  // "*ELASTIC\n..."
};
CalculixModel linear_model(const ElasticBody& body, std::function<std::string(const Material&)> words);
std::string elastic_words(const Material& material);
void write_calculix_model(fmt::ostream& out, const ElasticBody& body, const CalculixModel& model);

// Runs ccx on FOLDER/NAME.inp, one thread, everything it leaves in that folder. Errors: OperationError where it ends badly.
void run_calculix(const std::filesystem::path& folder, const std::string& name);

// Displacements of all nodes under forces ([3 nodes] N), linear; CalculiX prints seven digits. Creates folder and removes it.
// Errors: OperationError.
struct CalculixAnswer {
  std::vector<std::array<double, 3>> u;  // [nodes] m
  double seconds = 0;                    // processor time of CalculiX, with reading and writing its text files
};
CalculixAnswer solve_by_calculix(const std::filesystem::path& folder, const ElasticBody& body,
                                 const CalculixModel& model, std::span<const double> load);

}  // namespace palpate::accuracy
