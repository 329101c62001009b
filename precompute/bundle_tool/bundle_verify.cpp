#include <fmt/format.h>

#include "precompute/bundle_tool/bundle_checks.h"

namespace palpate {

using namespace formats;

namespace {

void run_checks(const BundleFile& file, const VerifyOptions& options, Checks& checks) {
  const SmallSections small = read_small_sections(file);
  checks.add(
      "structure", true,
      fmt::format("{} sections, layout {}", file.index().header.section_count, file.index().header.layout_version));
  check_finite_small(file, checks);
  check_indices(file, small, checks);
  if (!checks.all_held()) {
    check_checksums(file, {}, checks);
    return;  // the other checks would follow those indices
  }
  check_materials(file, small, checks);
  check_responses(file, checks);
  check_mesh(file, small, checks);
  check_certificate(file, small, checks);
  check_preload(file, small, checks);
  check_motions(file, small, checks);
  std::vector<Matrix3> compliance;
  check_stiffness(small, compliance, checks);

  const auto known = check_displacements(file, small, compliance, options.seed, checks);
  check_corridor(file, small, compliance, options.seed, checks);
  check_cut(file, small, compliance, checks);
  check_checksums(file, known, checks);
  if (!options.mesh.empty()) check_against_inputs(file, small, options, checks);
}

void print_report(const VerifyOptions& options, const Checks& checks) {
  if (options.json) {
    const nlohmann::json report = {
        {"file", options.bundle.string()}, {"held", checks.all_held()}, {"checks", checks.list}};
    fmt::print("{}\n", json_text(report));
    return;
  }
  for (const auto& check : checks.list)
    fmt::print("{:<8} {:<20} {}\n", check["held"].get<bool>() ? "ok" : "NOT HELD", check["name"].get<std::string>(),
               check["detail"].get<std::string>());
}

}  // namespace

void verify_bundle(const VerifyOptions& options) {
  Checks checks;
  try {
    const BundleFile file(options.bundle);
    run_checks(file, options, checks);
  } catch (const BundleRefused& refused) {
    // No bundle at all is bad input; a bundle that is broken does not hold.
    if (refused.status == BundleStatus::magic || refused.status == BundleStatus::version) throw;
    checks.add("structure", false, refused.what());
  }
  print_report(options, checks);
  if (checks.all_held()) return;
  for (const auto& check : checks.list)
    if (!check["held"].get<bool>())
      throw VerificationError(fmt::format("{}: {} does not hold: {}; copy the bundle again or rebuild it",
                                          options.bundle.string(), check["name"].get<std::string>(),
                                          check["detail"].get<std::string>()));
}

}  // namespace palpate
