// The checks of palpate-bundle verify, and the list of what they found.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "precompute/bundle_tool/bundle_commands.h"
#include "precompute/bundle_tool/bundle_file.h"
#include "precompute/elements/matrix3.h"

namespace palpate {

struct Checks {
  // One object for each check: name, held, detail and, where something was measured, found and bound.
  nlohmann::json list = nlohmann::json::array();

  void add(const std::string& name, bool held, const std::string& detail);
  // Holds where nothing is wrong; its detail is then fine.
  void add_faults(const std::string& name, const std::string& wrong, const std::string& fine);
  void add_bounded(const std::string& name, bool held, const std::string& what, double found, double bound);
  // Also says what the provenance states under that key, or "nothing".
  void add_stated(const std::string& name, bool held, const std::string& what, const nlohmann::json& provenance,
                  const char* key, double found, double bound);
  bool all_held() const;
};

// The numbers of the small sections, read once. stiffness: the section tensors/force, T^f.
struct SmallSections {
  std::vector<double> nodes, young, poisson, stiffness, residual;
  std::vector<std::int32_t> tetrahedra, region, triangles, touchable, iterations;
  std::vector<std::uint8_t> fixed;
  std::vector<double> foundation;  // empty: none
};

SmallSections read_small_sections(const BundleFile& file);

// check_indices must come first: the others use those indices.
void check_finite_small(const BundleFile& file, Checks& checks);
void check_indices(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_materials(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_responses(const BundleFile& file, Checks& checks);  // P and Q, where they were measured
void check_mesh(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_certificate(const BundleFile& file, const SmallSections& small, Checks& checks);
void check_preload(const BundleFile& file, const SmallSections& small, Checks& checks);  // where there is one
void check_motions(const BundleFile& file, const SmallSections& small, Checks& checks);  // where there are some

// T^f must be zero on fixed dofs, and symmetric and positive definite on the free ones. Fills compliance with C_kk =
// T^f_k^-1, in the order of small.touchable.
void check_stiffness(const SmallSections& small, std::vector<Matrix3>& compliance, Checks& checks);

// T^u must be finite, zero on fixed nodes and the identity at the touched node. Where all checks held so far, also
// checks reciprocity. Reads each byte once; returns the checksums of what it read.
std::map<formats::SectionId, std::uint64_t> check_displacements(const BundleFile& file, const SmallSections& small,
                                                                const std::vector<Matrix3>& compliance,
                                                                std::uint64_t seed, Checks& checks);

// The corridor's columns, where there are some: finite, zero on fixed dofs, a compliance that is symmetric to the bit and the same
// in the rows of the interior. Where all checks held so far and the touchable columns have an interior, also the reciprocity of
// both, for a few touchable nodes. Reads each byte of the corridor once.
void check_corridor(const BundleFile& file, const SmallSections& small, const std::vector<Matrix3>& compliance,
                    std::uint64_t seed, Checks& checks);

// The compliance of a cut's region, where there is one: finite, zero on fixed dofs, symmetric; each node has a column, and the numbers are those
// of the corridor and, of a node's own block, of the touchable column. Reads each byte once.
void check_cut(const BundleFile& file, const SmallSections& small, const std::vector<Matrix3>& compliance,
               Checks& checks);

// The tolerance of the provenance or, where that is larger, what double precision allowed; infinite where it states none.
double stated_tolerance(const BundleFile& file);

// Compares every section with its checksum. known: checksums that other checks have computed on the way.
void check_checksums(const BundleFile& file, const std::map<formats::SectionId, std::uint64_t>& known, Checks& checks);

// Compares the bundle with the files it was made from: their hashes, the body they give and, where all checks held so
// far, a random sample of columns that are solved again. Errors: InputError where the files cannot be read.
void check_against_inputs(const BundleFile& file, const SmallSections& small, const VerifyOptions& options,
                          Checks& checks);

// Draws count different numbers from 0 .. from - 1, ascending. The same seed gives the same numbers.
std::vector<std::int32_t> draw(std::size_t from, std::size_t count, std::uint64_t seed);

}  // namespace palpate
