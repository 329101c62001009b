// The checks of palpate-bundle verify: what they found, and the checks themselves.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "precompute/bundle_tool/bundle_commands.h"
#include "precompute/bundle_tool/bundle_file.h"
#include "precompute/bundle_tool/bundle_matrix3.h"

namespace palpate {

struct Checks {
  // Objects with name, held, detail and, where something was measured, found and bound.
  nlohmann::json list = nlohmann::json::array();

  void add(const std::string& name, bool held, const std::string& detail);
  void add_bounded(const std::string& name, bool held, const std::string& what, double found, double bound);
  // Also says what the provenance states under that key; "nothing" where it has none.
  void add_stated(const std::string& name, bool held, const std::string& what, const nlohmann::json& provenance,
                  const char* key, double found, double bound);
  bool all_held() const;
};

// What small sections hold, read once.
struct SmallSections {
  std::vector<double> nodes, young, poisson, force, residual;
  std::vector<std::int32_t> tetrahedra, region, triangles, touchable, iterations;
  std::vector<std::uint8_t> fixed;
};

SmallSections read_small_sections(const BundleFile& file);

// Structure of the mesh, materials, certificate and T^f. check_indices comes first: the others follow those indices.
void check_finite_small(const BundleFile& file, Checks& checks);
void check_indices(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_materials(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_mesh(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_certificate(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_preload(const BundleFile& file, const SmallSections& small, Checks& checks);  // where there is one

// T^f: zero on fixed dofs, symmetric and positive definite on the free ones. Fills compliance with C_kk = T^f_k^-1, in
// the order of small.touchable.
void check_force(const SmallSections& small, std::vector<Matrix3>& compliance, Checks& checks);

// T^u, each byte read once: finite, zero on fixed nodes, identity at the touched node; then reciprocity, when all
// checks held so far. Returns the checksums of what it read.
std::map<formats::SectionId, std::uint64_t> check_displacements(const BundleFile& file, const SmallSections& small,
                                                                const std::vector<Matrix3>& compliance,
                                                                std::uint64_t seed, Checks& checks);

// Every section against its checksum; known holds those that were computed on the way.
void check_checksums(const BundleFile& file, const std::map<formats::SectionId, std::uint64_t>& known, Checks& checks);

// The hashes and the body of the inputs against the bundle's; then, when all checks held so far, a random sample of
// columns solved again. Errors: InputError for inputs that cannot be read.
void check_against_inputs(const BundleFile& file, const SmallSections& small, const VerifyOptions& options,
                          Checks& checks);

// count positions out of 0 .. from - 1, ascending; the same seed draws the same.
std::vector<std::int32_t> draw(std::size_t from, std::size_t count, std::uint64_t seed);

}  // namespace palpate
