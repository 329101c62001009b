#include "precompute/run/run_inputs.h"

#include <fmt/format.h>

#include "formats/errors.h"
#include "formats/make_rule.h"
#include "formats/program.h"
#include "precompute/elements/element_warnings.h"
#include "precompute/elements/plausibility.h"
#include "precompute/elements/support_check.h"

namespace palpate {
namespace {

void check_densities(const RunInputs& inputs, const PrecomputeOptions& options) {
  for (std::size_t r = 0; r < inputs.body.materials.size(); ++r)
    if (inputs.body.materials[r].density <= 0)
      throw InputError(
          fmt::format("{}: [preload] gravity needs the density of every region; [[region]] \"{}\" of {} has none",
                      options.boundary.string(), inputs.body.region_names[r], options.organ.string()));
}

std::string hash_or_nothing(const std::filesystem::path& file) {
  if (!file.empty()) has_read(file);
  return file.empty() ? std::string() : sha256_of_file(file.string());
}

std::map<std::string, std::string> hashes_of(const PrecomputeOptions& options, const OrganConfig& organ,
                                             const BoundaryConfig& boundary) {
  std::map<std::string, std::string> hashes = {{"image_sha256", hash_or_nothing(options.image)},
                                               {"mesh_sha256", hash_or_nothing(options.mesh)},
                                               {"organ_sha256", hash_or_nothing(options.organ)},
                                               {"boundary_sha256", hash_or_nothing(options.boundary)}};
  for (const auto& [key, file] : files_of(organ, boundary))
    if (std::filesystem::is_regular_file(file))  // else refused where it is read
      hashes[key] = hash_or_nothing(file);
  return hashes;
}

}  // namespace

RunInputs read_run_inputs(const PrecomputeOptions& options) {
  RunInputs inputs;
  if (!options.image.empty() && !std::filesystem::is_regular_file(options.image))
    throw InputError(fmt::format("{}: expected the image file, found none", options.image.string()));
  inputs.organ = read_organ_config(options.organ);
  inputs.boundary = read_boundary_config(options.boundary);
  inputs.large_deformation = options.large_deformation || inputs.boundary.store_large_deformation;
  if (inputs.large_deformation && inputs.organ.element == Element::p2_p0)
    throw InputError(fmt::format(
        "{}: {}: expected the element p1, p1-anp or p1-ang, found p2-p0; change it, or leave the {} out",
        options.organ.string(), options.large_deformation ? "--large-deformation" : "large_deformation in [store]",
        options.large_deformation ? "option" : "key"));
  if (inputs.organ.response) inputs.fit = fit_responses(*inputs.organ.response);
  inputs.hashes = hashes_of(options, inputs.organ, inputs.boundary);
  const BodyFiles files{options.mesh, options.organ, options.boundary, options.image};
  inputs.body = make_elastic_body(read_mesh(options.mesh), inputs.organ, inputs.boundary, files);
  for (const auto& sentence : plausibility_warnings(inputs.body, inputs.organ, files)) warn(sentence);
  if (inputs.boundary.gravity) check_densities(inputs, options);
  check_support(inputs.body, options.boundary, inputs.organ.mesh_unit);
  for (const auto& sentence : element_warnings(inputs.body, inputs.organ.element))
    warn(fmt::format("{}: {}", options.organ.string(), sentence));
  const bool has_interior = inputs.body.surface_count < static_cast<std::int32_t>(inputs.body.nodes.size());
  const bool wants_interior = options.interior || inputs.boundary.store_interior;
  if (wants_interior && !has_interior)
    warn(fmt::format("the mesh has no interior nodes; {} has no effect",
                     options.interior ? "--interior" : "[store] interior"));
  inputs.store_interior = wants_interior && has_interior;
  return inputs;
}

}  // namespace palpate
