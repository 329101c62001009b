// Solves a sample of columns again from the mesh and the configs, in another way than the precompute, and compares.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/organ_config.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "precompute/bundle_tool/bundle_checks.h"
#include "precompute/bundle_tool/column_errors.h"
#include "precompute/bundle_tool/independent_solve.h"
#include "precompute/elements/elastic_body.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {

using namespace formats;

namespace {

// True relative residual of the columns that are solved again. The bound below then is some 1e-6: a solver that is wrong by
// more is found, and GAMG takes a second for the default organ.
constexpr double kTolerance = 1e-9;

// The hashes of files against those that the bundle recorded.
void check_hashes(const BundleFile& file, const std::vector<std::pair<std::string, std::filesystem::path>>& files,
                  const std::string& name, const char* made, const std::string& fine, Checks& checks) {
  const nlohmann::json provenance = file.provenance();
  std::string wrong;
  for (const auto& [key, path] : files)
    if (!std::filesystem::is_regular_file(path) || !provenance.contains(key) ||
        provenance[key] != sha256_of_file(path.string()))
      wrong += fmt::format("{}{} is not the file it was made {}", wrong.empty() ? "" : ", ", path.string(), made);
  checks.add_faults(name, wrong, fine);
}

template <class Row, class Number>
bool same(const std::vector<Row>& rows, const std::vector<Number>& flat) {
  if (rows.size() * std::tuple_size_v<Row> != flat.size()) return false;
  for (std::size_t i = 0; i < flat.size(); ++i)
    if (rows[i / std::tuple_size_v<Row>][i % std::tuple_size_v<Row>] != flat[i]) return false;
  return true;
}

// The bundle's nodes, elements, supports and materials are what the inputs give, bit for bit.
void check_body(const ElasticBody& body, const SmallSections& small, Checks& checks) {
  std::string wrong;
  const auto require = [&](bool equal, const char* what) {
    if (!equal) wrong += (wrong.empty() ? "" : ", ") + std::string(what);
  };
  require(same(body.nodes, small.nodes), "nodes");
  require(same(body.tetrahedra, small.tetrahedra), "tetrahedra");
  require(body.region == small.region, "regions");
  require(same(body.triangles, small.triangles), "triangles");
  require(same(body.fixed, small.fixed), "fixed dofs");
  require(same(foundation_of_triangles(body), small.foundation), "foundations");
  // pack may have kept a part of them.
  require(std::includes(body.touchable.begin(), body.touchable.end(), small.touchable.begin(), small.touchable.end()),
          "touchable nodes");
  bool materials = body.materials.size() == small.young.size();
  for (std::size_t r = 0; materials && r < body.materials.size(); ++r)
    materials = body.materials[r].young == small.young[r] && body.materials[r].poisson == small.poisson[r];
  require(materials, "materials");
  if (!wrong.empty()) wrong = "the inputs give other " + wrong;
  checks.add_faults("same body", wrong, "mesh, supports and materials are those of the inputs");
}

// A difference from what was solved again, relative in 2-norms; as it is where the solution is zero.
struct RelativeError {
  double difference = 0, size = 0;
  void add(double stored, double solved) { difference += std::pow(stored - solved, 2), size += std::pow(solved, 2); }
  double value() const { return std::sqrt(size > 0 ? difference / size : difference); }
};

struct SolvedErrors {
  ColumnErrors displacement;
  double stiffness = 0, residual = 0;  // relative, in 2-norms; of the new solve
};

SolvedErrors compare_columns(const BundleFile& file, const SmallSections& small, const std::vector<std::int32_t>& drawn,
                             const std::vector<NodeTensor>& solved) {
  SolvedErrors found;
  StoredColumns columns(file);
  ColumnRows stored, expected;
  const std::size_t surface = 3 * columns.surface_nodes(), all = 3 * file.index().counts.nodes;
  for (std::size_t s = 0; s < drawn.size(); ++s) {
    const auto k = static_cast<std::size_t>(drawn[s]);
    columns.read(k, stored);
    expected.surface.clear(), expected.interior.clear();
    for (std::size_t j = 0; j < 3; ++j) {
      const auto row = solved[s].displacement.begin() + static_cast<std::ptrdiff_t>(j * all);
      expected.surface.insert(expected.surface.end(), row, row + static_cast<std::ptrdiff_t>(surface));
      expected.interior.insert(expected.interior.end(), row + static_cast<std::ptrdiff_t>(surface),
                               row + static_cast<std::ptrdiff_t>(all));
    }
    found.displacement.add(stored, expected, solved[s].node);
    RelativeError stiffness;
    for (int i = 0; i < 9; ++i) stiffness.add(small.stiffness[9 * k + i], solved[s].stiffness[i]);
    found.stiffness = std::max(found.stiffness, stiffness.value());
    found.residual = std::max(found.residual, solved[s].residual);
  }
  return found;
}

// What storing may have cost a column, relative: stated by pack, or the rounding of the type that holds it.
double storing_bound(const BundleFile& file, const nlohmann::json& provenance) {
  if (const auto stated = number_of(provenance, "stored_error")) return *stated * (1 + 1e-6);
  return 2 * StoredColumns(file).relative_rounding();
}

// As for columns: what a residual leaves of a solution, and the rounding to single precision.
void add_solved_again(const BundleFile& file, const ElasticBody& body, SectionId residuals, const std::string& name,
                      const std::string& what, double worst, Checks& checks) {
  const auto residual = file.numbers<double>(residuals);
  const double largest = *std::max_element(residual.begin(), residual.end());
  const double bound = 1.2e-7 + 10 * std::sqrt(3.0 * static_cast<double>(body.nodes.size())) * (largest + kTolerance);
  checks.add_bounded(name, worst <= bound, "largest relative error of " + what, worst, bound);
}

// All motions solved again. Names, kinds and order are those of the boundary file.
void check_motions_again(const BundleFile& file, const ElasticBody& body, Element element, Checks& checks) {
  const auto kinds = file.numbers<std::int32_t>(SectionId::motion_kinds);
  if (kinds.empty() && body.motions.empty()) return;
  std::string names;
  bool same_kinds = kinds.size() == body.motions.size();
  for (std::size_t i = 0; i < body.motions.size(); ++i) {
    names += body.motions[i].name + '\n';
    same_kinds = same_kinds && kinds[i] == static_cast<std::int32_t>(body.motions[i].kind);
  }
  if (!same_kinds || names != file.text(SectionId::motion_names))
    return checks.add("motions solved again", false, "the inputs give other motions");
  const auto surface = file.numbers<float>(SectionId::motion_surface),
             interior = file.numbers<float>(SectionId::motion_interior);
  const auto solved = solve_motions_independently(body, element, kTolerance);
  const std::size_t near = 3 * file.index().counts.surface_nodes, far = interior.size() / kinds.size();
  double worst = 0;
  for (std::size_t m = 0; m < solved.size(); ++m) {
    RelativeError error;
    for (std::size_t i = 0; i < near + far; ++i)
      error.add(i < near ? surface[m * near + i] : interior[m * far + i - near], solved[m][i]);
    worst = std::max(worst, error.value());
  }
  add_solved_again(file, body, SectionId::motion_residual, "motions solved again",
                   fmt::format("{} motions", solved.size()), worst, checks);
}

// A sample of the corridor's columns solved again.
void check_corridor_again(const BundleFile& file, const ElasticBody& body, Element element,
                          const VerifyOptions& options, Checks& checks) {
  const auto stored = file.numbers<std::int32_t>(SectionId::corridor_nodes);
  if (stored.empty() && body.corridor_nodes.empty()) return;
  if (stored != body.corridor_nodes) return checks.add("corridors solved again", false, "the inputs give other nodes");
  const auto drawn = draw(stored.size(), std::min<std::size_t>(stored.size(), options.columns), options.seed);
  std::vector<std::int32_t> nodes;
  for (const auto k : drawn) nodes.push_back(stored[k]);
  const auto solved = solve_columns_independently(body, element, nodes, kTolerance);
  const std::size_t near = 3 * file.index().counts.surface_nodes;
  double worst = 0;
  for (std::size_t c = 0; c < solved.size(); ++c) {
    RelativeError error;
    for (const auto& [id, first] :
         {std::pair{SectionId::corridor_surface, std::size_t{0}}, {SectionId::corridor_interior, near}}) {
      const SectionEntry* entry = file.find(id);
      if (!entry) continue;
      std::vector<float> row(3 * entry->shape[2]);
      file.read(*entry, (3 * static_cast<std::size_t>(drawn[c / 3]) + c % 3) * row.size() * sizeof(float), row.data(),
                row.size() * sizeof(float));
      for (std::size_t i = 0; i < row.size(); ++i) error.add(row[i], solved[c][first + i]);
    }
    worst = std::max(worst, error.value());
  }
  add_solved_again(file, body, SectionId::corridor_residual, "corridors solved again",
                   fmt::format("{} columns", solved.size()), worst, checks);
}

// A sample of the columns of a cut's region solved again.
void check_cut_again(const BundleFile& file, const ElasticBody& body, Element element, const VerifyOptions& options,
                     Checks& checks) {
  const auto stored = file.numbers<std::int32_t>(SectionId::cut_nodes);
  if (stored.empty() && body.cut_nodes.empty()) return;
  if (stored != body.cut_nodes) return checks.add("cut solved again", false, "the inputs give other nodes");
  const auto drawn = draw(stored.size(), std::min<std::size_t>(stored.size(), options.columns), options.seed);
  std::vector<std::int32_t> nodes;
  for (const auto a : drawn) nodes.push_back(stored[a]);
  const auto solved = solve_columns_independently(body, element, nodes, kTolerance);
  std::vector<RelativeError> errors(solved.size());
  for (std::size_t k = 0; k < drawn.size(); ++k)
    for (std::size_t b = 0; b < stored.size(); ++b) {
      const auto a = static_cast<std::size_t>(drawn[k]), high = std::max(a, b), low = std::min(a, b);
      double block[9];
      file.read(*file.find(SectionId::cut_compliance), (high * (high + 1) / 2 + low) * sizeof block, block,
                sizeof block);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          errors[3 * k + j].add(block[b >= a ? 3 * i + j : 3 * j + i],
                                solved[3 * k + j][3 * static_cast<std::size_t>(stored[b]) + i]);
    }
  double worst = 0;
  for (const RelativeError& error : errors) worst = std::max(worst, error.value());
  add_solved_again(file, body, SectionId::cut_residual, "cut solved again", fmt::format("{} columns", solved.size()),
                   worst, checks);
}

}  // namespace

void check_against_inputs(const BundleFile& file, const SmallSections& small, const VerifyOptions& options,
                          Checks& checks) {
  check_hashes(file,
               {{"mesh_sha256", options.mesh}, {"organ_sha256", options.organ}, {"boundary_sha256", options.boundary}},
               "input hashes", "from", "mesh, organ and boundary are the files it was made from", checks);
  const OrganConfig organ = read_organ_config(options.organ);
  const BoundaryConfig boundary = read_boundary_config(options.boundary);
  // What the configs read: the measured curve, the images of selectors, the fields of motions.
  auto files = files_of(organ, boundary);
  if (!options.image.empty()) files["image_sha256"] = options.image;
  if (!files.empty())
    check_hashes(file, {files.begin(), files.end()}, "file hashes", "with",
                 "the curve, images and fields are those it was made with", checks);
  const ElasticBody body = make_elastic_body(read_mesh(options.mesh), organ, boundary,
                                             {options.mesh, options.organ, options.boundary, options.image});
  check_body(body, small, checks);
  if (!checks.all_held()) return;

  const auto drawn =
      draw(small.touchable.size(), std::min<std::size_t>(small.touchable.size(), options.columns), options.seed);
  const PetscSession session({});
  check_motions_again(file, body, organ.element, checks);
  check_corridor_again(file, body, organ.element, options, checks);
  check_cut_again(file, body, organ.element, options, checks);
  std::vector<std::int32_t> nodes;
  for (const auto k : drawn) nodes.push_back(small.touchable[k]);
  const double stored_residual = *std::max_element(small.residual.begin(), small.residual.end());
  const auto solved = solve_independently(body, organ.element, nodes, kTolerance);
  const SolvedErrors found = compare_columns(file, small, drawn, solved);

  // A residual r leaves C r in a column C e: relative to it at most the largest eigenvalue of C over |C e|. A column
  // that takes its share in the softest mode has |C e| of about that eigenvalue over sqrt(3 N); ten is for those that
  // take less. Storing adds what it states, or the rounding of its type.
  const double amplification = 10 * std::sqrt(3.0 * static_cast<double>(body.nodes.size()));
  const double solving = amplification * (stored_residual + found.residual);
  const nlohmann::json provenance = file.provenance();
  const bool packed = provenance.contains("stored_error");
  const double bound = storing_bound(file, provenance) + solving;
  checks.add_stated("solved again", found.displacement.worst <= bound,
                    fmt::format("largest relative error of {} columns (node {} dof {})", 3 * drawn.size(),
                                found.displacement.worst_node, "xyz"[found.displacement.worst_dof]),
                    provenance, packed ? "stored_error" : "cast_error", found.displacement.worst, bound);
  // T^f is stored in double; 1e-12 is for the inverse of its 3 x 3 block.
  checks.add_bounded("T^f solved again", found.stiffness <= 1e-12 + solving,
                     fmt::format("largest relative error of {} blocks", drawn.size()), found.stiffness,
                     1e-12 + solving);
}

}  // namespace palpate
