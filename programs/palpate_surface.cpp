// palpate-surface: makes a closed triangle surface in LPS mm from a label image or from a segmented surface; lists the
// labels of an image.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/make_rule.h"
#include "formats/processor_limit.h"
#include "formats/program.h"
#include "meshing/image/label_image.h"
#include "meshing/image/label_list.h"
#include "meshing/image/voxel_mask.h"
#include "meshing/surface/extract_surface.h"
#include "meshing/surface/repair_surface.h"
#include "meshing/surface/surface_file.h"
#include "meshing/surface/surface_report.h"
#include "meshing/surface/wrap_surface.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> inputs;
  std::filesystem::path output, report;
  LabelSelection selection;
  std::optional<double> smooth_mm;
  SurfaceTarget target;
  std::string spread = "even", components = "1%", cavities, unit = "mm";
  bool list = false;
  bool wrap = false;
  double wrap_mm = 0;
  MakeRule rule;
};

void define(CLI::App& app, Options& options) {
  app.add_option(
         "input", options.inputs,
         "Label image (.inr .inr.gz .nrrd .nhdr .nii .nii.gz .mha .mhd) or segmented surface (.off .obj .ply .stl)")
      ->required();
  auto* list = app.add_flag("--list", options.list,
                            "Print each label of an image: name, volume, pieces, box, whether it touches the border");
  auto* output = app.add_option("-o,--output", options.output, "Surface to write: .off .ply .stl .obj");
  auto* labels = app.add_option("--labels", options.selection.labels, "Values of the organ, united: 255 or 255,127")
                     ->delimiter(',');
  app.add_option("--threshold", options.selection.threshold, "Everything at or above this value")->excludes(labels);
  app.add_option("--smooth", options.smooth_mm, "Gaussian width in mm; 0 for none (default: 1.5 mean voxel sides)")
      ->check(non_negative_number());
  auto* triangles = app.add_option("--triangles", options.target.triangles,
                                   "How many triangles (default: 2000 of an image, a surface's own)")
                        ->check(CLI::Range(40, 20'000'000));
  app.add_option("--edge-mm", options.target.edge_mm, "Or their edge length in mm")
      ->check(positive_number())
      ->excludes(triangles);
  app.add_option("--spread", options.spread, "Triangles: even, or denser by curvature")
      ->check(CLI::IsMember({"even", "curvature"}))
      ->capture_default_str();
  app.add_option("--components", options.components,
                 "Pieces to keep: all, largest, a count, a volume (2.5mm3, 1cm3) or a share of the largest (1%)")
      ->capture_default_str();
  app.add_option("--cavities", options.cavities,
                 "keep or fill holes inside (default: fill those of an image, keep those of a surface)")
      ->check(CLI::IsMember({"keep", "fill"}));
  app.add_option("--unit", options.unit, "Unit of a surface's coordinates; images have their own")
      ->check(CLI::IsMember({"m", "cm", "mm", "um"}))
      ->capture_default_str();
  auto* wrap =
      app.add_flag("--wrap", options.wrap,
                   "Wrap a surface that is open, crosses itself or is no manifold into a closed one; fills cavities");
  app.add_option("--wrap-mm", options.wrap_mm,
                 "Radius of the wrapping ball, mm; narrower gaps close (default: 1/60 of the box)")
      ->check(positive_number())
      ->needs(wrap);
  app.add_option("--report", options.report, "Also write the quality report, or the list, as JSON");
  define_make_rule(app, options.rule);
  for (const char* of_a_surface : {"--output", "--labels", "--threshold", "--smooth", "--triangles", "--edge-mm",
                                   "--spread", "--components", "--cavities", "--unit", "--wrap", "--wrap-mm"})
    list->excludes(app.get_option(of_a_surface));
  app.callback([output, &options] {
    if (!options.list && output->empty()) throw CLI::RequiredError("--output");
  });
}

void tell(const PieceChanges& changes, const std::string& components) {
  if (changes.dropped) {
    warn(fmt::format(
        "dropped {} of {} pieces, {:.4g} mm3 in all, the largest {:.4g} mm3 (--components {}; all keeps them)",
        changes.dropped, changes.pieces, changes.dropped_mm3, changes.largest_dropped_mm3, components));
  }
  if (changes.filled) {
    warn(fmt::format("filled {} cavities, {:.4g} mm3 in all, the largest {:.4g} mm3 (--cavities keep keeps them)",
                     changes.filled, changes.filled_mm3, changes.largest_filled_mm3));
  } else if (changes.cavities) {
    note(fmt::format("kept {} cavities", changes.cavities));
  }
}

void tell(const ExtractedSurface& extracted, double smooth_mm) {
  if (extracted.vanished_pieces) {
    warn(fmt::format("smoothing by {:.3g} mm removed {} pieces, {:.4g} mm3 in all; a smaller --smooth keeps them",
                     smooth_mm, extracted.vanished_pieces, extracted.vanished_mm3));
  }
  if (extracted.closed_cavities) {
    warn(fmt::format("smoothing by {:.3g} mm closed {} cavities; a smaller --smooth keeps them", smooth_mm,
                     extracted.closed_cavities));
  }
  if (extracted.thin_mm3 > 0) {
    warn(fmt::format(
        "parts thinner than the smoothing width of {:.3g} mm were lost: {:.4g} mm3, the first near ({:.5g}, "
        "{:.5g}, {:.5g}) mm; a smaller --smooth keeps them",
        smooth_mm, extracted.thin_mm3, extracted.thin_place[0], extracted.thin_place[1], extracted.thin_place[2]));
  }
}

void from_image(const Options& options) {
  const std::string& name = options.inputs.front();
  const LabelImage image = read_label_image(name);
  const std::array<double, 3> spacing = image.grid.spacing();
  note(fmt::format("{}: {} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm", name, image.grid.size[0],
                   image.grid.size[1], image.grid.size[2], spacing[0], spacing[1], spacing[2]));

  const double smooth_mm = options.smooth_mm.value_or(1.5 * std::cbrt(image.grid.voxel_volume()));
  VoxelMask mask = select_voxels(image, options.selection, 0, name);
  if (mask.touched_border) {
    warn("the label touches the image's border, where the organ may be cut off; padded and closed there");
  }
  const PieceChanges changes =
      filter_pieces(mask, parse_piece_filter(options.components), options.cavities != "keep", name);
  tell(changes, options.components);

  const ExtractedSurface extracted = extract_surface(mask, smooth_mm, options.target, name);
  tell(extracted, extracted.smooth_mm);

  const double voxels_mm3 = static_cast<double>(count_inside(mask)) * mask.grid.voxel_volume();
  const SurfaceQuality quality = measure_quality(extracted.surface);
  const SurfaceDistance distance = measure_distance(extracted.voxel_surface, extracted.surface);
  const std::string lost_tip = lost_tip_warning(distance, voxels_mm3, std::cbrt(mask.grid.voxel_volume()),
                                                "more --triangles or a smaller --smooth keep it");
  if (!lost_tip.empty()) warn(lost_tip);
  write_surface(options.output, extracted.surface);
  if (!options.report.empty()) {
    nlohmann::ordered_json json = report_json(quality, distance, voxels_mm3, "voxels");
    json["smooth_mm"] = extracted.smooth_mm;
    json["pieces"] = changes.pieces;
    json["dropped_pieces"] = changes.dropped;
    json["dropped_mm3"] = changes.dropped_mm3;
    json["cavities"] = changes.cavities;
    json["filled_cavities"] = changes.filled;
    json["filled_mm3"] = changes.filled_mm3;
    json["vanished_mm3"] = extracted.vanished_mm3;
    json["thin_mm3"] = extracted.thin_mm3;
    json["lost_tip_mm"] = distance.outside_mm;
    json["touched_border"] = mask.touched_border;
    json["attempts"] = extracted.attempts;
    json["warnings"] = warnings();
    write_text_atomically(options.report, json.dump(2) + "\n");
  }
  fmt::print("{}", report_text(quality, distance, voxels_mm3, "voxels"));
}

double millimetres(const std::string& unit) {
  return unit == "m" ? 1000 : unit == "cm" ? 10 : unit == "um" ? 1e-3 : 1;
}

void write_report(const Options& options, const TriangleSurface& surface, const TriangleSurface& input,
                  double input_mm3, nlohmann::ordered_json more) {
  const SurfaceQuality quality = measure_quality(surface);
  const SurfaceDistance distance = measure_distance(input, surface), back = measure_distance(surface, input);
  write_surface(options.output, surface);
  if (!options.report.empty()) {
    nlohmann::ordered_json json = report_json(quality, distance, input_mm3, "input");
    json["distance_from_surface_mm"] = {{"mean", back.mean_mm}, {"p95", back.p95_mm}, {"most", back.most_mm}};
    json.update(more);
    json["warnings"] = warnings();
    write_text_atomically(options.report, json.dump(2) + "\n");
  }
  fmt::print("{}", report_text(quality, distance, input_mm3, "input", back));
}

// Seconds of processor time for a surface: 20, or 0.2 ms for each of its triangles and 2 ms for each that is asked for.
double processor_limit(const Options& options, const TriangleSurface& soup) {
  double asked = static_cast<double>(options.target.triangles.value_or(0));
  if (options.target.edge_mm) asked = 2.3 * area(soup) / (*options.target.edge_mm * *options.target.edge_mm);
  return std::max(20.0, 2e-4 * static_cast<double>(soup.triangles.size()) + 2e-3 * asked);
}

// What is said when a surface takes all of it.
std::string too_slow(const Options& options, const TriangleSurface& soup, double limit) {
  const std::string& name = options.inputs.front();
  return fmt::format(
      "{}: expected to be done within {:.0f} s of processor time, found triangles that take longer; {}; {}", name,
      limit, text_of(worst_triangle(soup)),
      options.wrap ? "wrap it with a larger ball, --wrap-mm, or ask for fewer --triangles" : wrap_advice(name));
}

// The wrap is solid: a hollow input comes out filled.
void tell_wrapped_volume(double wrapped_mm3, double input_mm3, const std::string& name) {
  constexpr double kAlike = 0.1;  // of the volume; the wraps of solid inputs of the tests are within 0.01
  if (input_mm3 > 0 && std::abs(wrapped_mm3 / input_mm3 - 1) <= kAlike) return;
  warn(fmt::format(
      "{}: the wrapped surface encloses {:.4g} mm3, and the input {:.4g} mm3: expected the same within {:g} %; a wrap "
      "fills the space inside of thin walls and between parts closer than the ball; --wrap-mm takes a smaller ball, "
      "and a hollow organ needs a closed file of its own for the space inside",
      name, wrapped_mm3, input_mm3, 100 * kAlike));
}

void wrap(const Options& options, const TriangleSurface& soup, std::optional<ProcessorLimit>& ends_the_program) {
  const std::string& name = options.inputs.front();
  if (!options.cavities.empty()) throw InputError(fmt::format("{}: --wrap fills cavities; leave out --cavities", name));
  SurfaceTarget target = options.target;
  if (!target.triangles && !target.edge_mm) target.triangles = 2000;
  int attempts = 0;
  for (const double share : {0.1, 0.3, 1.0}) {
    const WrappedSurface wrapped =
        wrap_surface(soup, parse_piece_filter(options.components), options.wrap_mm, share, name);
    TriangleSurface surface;
    try {
      // Taking the offset off again makes tips and walls thinner, on which the first try failed.
      surface = remesh_surface(wrapped.surface, target, name, &attempts, share == 0.1 ? wrapped.offset_mm : 0);
    } catch (const NoValidSurface& failed) {
      if (share == 1) throw;
      warn(fmt::format("{}; wrapping it thicker", failed.what()));
      continue;
    }
    ends_the_program.reset();
    for (const std::string& change : wrapped.changes) warn(fmt::format("{}: {}", name, change));
    note(fmt::format("wrapped with a ball of {:.3g} mm: gaps narrower than {:.3g} mm are bridged", wrapped.ball_mm,
                     2 * wrapped.ball_mm));
    tell_wrapped_volume(enclosed_volume(surface), wrapped.input_mm3, name);
    return write_report(options, surface, wrapped.input, wrapped.input_mm3,
                        {{"changes", wrapped.changes}, {"ball_mm", wrapped.ball_mm}, {"attempts", attempts}});
  }
}

void from_surface(const Options& options) {
  const std::string& name = options.inputs.front();
  if (!options.selection.labels.empty() || options.selection.threshold || options.smooth_mm)
    throw InputError(fmt::format("{}: --labels, --threshold and --smooth are for images", name));
  const TriangleSurface soup = read_surface(name, millimetres(options.unit));
  const double limit = processor_limit(options, soup);
  std::optional<ProcessorLimit> ends_the_program;
  ends_the_program.emplace("palpate-surface", limit, too_slow(options, soup, limit));
  if (options.wrap) return wrap(options, soup, ends_the_program);
  const RepairedSurface repaired = repair_surface(soup, parse_piece_filter(options.components), options.cavities, name);
  for (const std::string& repair : repaired.repairs) warn(fmt::format("{}: {}", name, repair));

  TriangleSurface surface = repaired.surface;
  int attempts = 0;
  if (options.target.triangles || options.target.edge_mm)
    surface = remesh_surface(surface, options.target, name, &attempts);
  ends_the_program.reset();
  write_report(options, surface, repaired.surface, enclosed_volume(repaired.surface),
               {{"repairs", repaired.repairs}, {"attempts", attempts}});
}

void list(const Options& options) {
  const std::string& name = options.inputs.front();
  if (!is_image_name(name)) throw InputError(fmt::format("{}: --list is for images; a surface has no labels", name));
  const std::vector<LabelEntry> labels = list_labels(read_label_image(name), name);
  if (labels.empty())
    throw InputError(fmt::format("{}: expected a segmented organ, found an image that is 0 everywhere", name));
  if (!options.report.empty()) write_text_atomically(options.report, label_list_json(labels).dump(2) + "\n");
  fmt::print("{}", label_list_text(labels));
}

void run(Options& options) {
  if (options.inputs.size() > 1)
    throw InputError(fmt::format("{}: expected one image or surface at a time; save slices as one NRRD or NIfTI",
                                 options.inputs[1]));
  if (options.list) return list(options);
  check_output_name(options.output);
  if (options.spread == "curvature") options.target.spread = SurfaceTarget::Spread::curvature;
  const bool image = is_image_name(options.inputs.front());
  if (!image) return from_surface(options);
  if (options.wrap)
    throw InputError(fmt::format("{}: --wrap is for surfaces; an image needs none", options.inputs.front()));
  if (!options.target.triangles && !options.target.edge_mm) options.target.triangles = 2000;
  from_image(options);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::Options options;
  return palpate::run_program(
      argc, argv, "palpate-surface", "Label image or segmented surface -> closed triangle surface in LPS mm",
      [&](CLI::App& app) { palpate::define(app, options); },
      [&] { palpate::run(options), palpate::write_make_rule(options.rule); });
}
