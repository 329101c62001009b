// palpate-bundle pack: a bundle that takes fewer bytes, with the error that this costs measured and stated.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "formats/atomic_file.h"
#include "formats/bundle_writer.h"
#include "formats/element_layout.h"
#include "formats/half.h"
#include "formats/organ_config.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "precompute/bundle_tool/bundle_commands.h"
#include "precompute/bundle_tool/column_errors.h"
#include "precompute/bundle_tool/compliance_packer.h"
#include "precompute/bundle_tool/stored_columns.h"
#include "precompute/elements/matrix3.h"

namespace palpate {

using namespace formats;

namespace {

// The provenance is laid out before its numbers are known. Each of at most 16 numbers takes at most 32 characters as
// JSON.
constexpr std::size_t kRoomForNumbers = 16 * 32;

// ---- which columns --------------------------------------------------------------------------------------------------

// The nodes of the outer surface, in the order of the mesh file, which is that of the surface nodes of a bundle.
std::vector<std::int32_t> surface_nodes_of(const TetrahedralMesh& mesh) {
  std::vector<std::int32_t> nodes;
  for (const auto& triangle : boundary_triangles(mesh)) nodes.insert(nodes.end(), triangle.begin(), triangle.end());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

// A cut acts on nodes of the surface through their columns. wanted: of each surface node.
void check_cut_keeps_columns(const BundleFile& source, const std::vector<std::int32_t>& touchable,
                             const std::vector<bool>& wanted) {
  const auto cut = source.numbers<std::int32_t>(SectionId::cut_nodes);
  const auto lost = std::ranges::count_if(touchable, [&](std::int32_t node) {
    return !wanted[static_cast<std::size_t>(node)] && std::ranges::binary_search(cut, node);
  });
  if (lost > 0)
    throw InputError(
        fmt::format("{}: expected that all {} nodes of its cut's region (section cut/nodes) keep their "
                    "columns, found that {} would lose them; keep them too, or take a bundle without [cut]",
                    source.path().string(), cut.size(), lost));
}

// The slots (positions in the section tensors/nodes) of the columns to keep, ascending.
std::vector<std::size_t> kept_columns(const BundleFile& source, const PackOptions& options) {
  const auto touchable = source.numbers<std::int32_t>(SectionId::touchable);
  std::vector<std::size_t> kept(touchable.size());
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  if (options.touchable.empty() && options.patches.empty()) return kept;

  const nlohmann::json provenance = source.provenance();
  if (!provenance.is_object() || provenance.value("mesh_sha256", "") != sha256_of_file(options.mesh.string()))
    throw InputError(
        fmt::format("{}: expected the mesh that {} was made from, found another; its nodes would be others",
                    options.mesh.string(), source.path().string()));
  const TetrahedralMesh mesh = read_mesh(options.mesh);
  const auto surface = surface_nodes_of(mesh);
  std::vector<Selector> selectors;
  std::filesystem::path file = "--patch";
  if (!options.touchable.empty()) {
    file = options.touchable;
    selectors = read_boundary_config(file).touchable;
    if (selectors.empty())
      throw InputError(fmt::format("{}: has no [touchable]; add one that selects the nodes to keep, or give --patch",
                                   file.string()));
  }
  for (const std::string& patch : options.patches) {
    Selector selector = {};
    selector.kind = Selector::Kind::patch;
    selector.names = {patch};
    selectors.push_back(selector);
  }
  std::vector<bool> wanted(surface.size(), false);
  for (const auto node : select_nodes(selectors, mesh, surface, file)) {
    const auto at = std::lower_bound(surface.begin(), surface.end(), node);
    if (at != surface.end() && *at == node) wanted[static_cast<std::size_t>(at - surface.begin())] = true;
  }
  std::erase_if(kept, [&](std::size_t k) { return !wanted[static_cast<std::size_t>(touchable[k])]; });
  if (kept.empty())
    throw InputError(fmt::format("{}: selects none of the {} touchable nodes of {}; it can only choose among those",
                                 file.string(), touchable.size(), source.path().string()));
  check_cut_keeps_columns(source, touchable, wanted);
  return kept;
}

// ---- what is refused ------------------------------------------------------------------------------------------------

void check_options(const PackOptions& options) {
  std::error_code ignored;
  if (std::filesystem::equivalent(options.bundle, options.output, ignored))
    throw InputError(fmt::format("{}: is the bundle to pack itself; give -o another name", options.output.string()));
  const bool subset = !options.touchable.empty() || !options.patches.empty();
  if (!options.precision && !options.surface && !subset && !options.low_rank && options.accuracy.empty())
    throw InputError(
        "nothing to do: expected at least one of --precision, --surface, --touchable, --patch, --low-rank and "
        "--accuracy");
  if (subset == options.mesh.empty())
    throw InputError(subset ? "--touchable and --patch need --mesh, the mesh file that the bundle was made from"
                            : "--mesh is only used with --touchable or --patch; leave it out or add one of them");
  if (options.low_rank) check_low_rank(*options.low_rank);
}

ElementType target_type(const StoredColumns& columns, const BundleFile& source, const PackOptions& options) {
  const std::string file = source.path().string();
  const ElementType from = columns.type();
  const bool rounds = options.precision == ElementType::f16 && from == ElementType::f32, subset = !options.mesh.empty();
  if (columns.in_blocks() && (!rounds || subset || options.low_rank))
    throw InputError(fmt::format(
        "{}: is already packed in blocks, of {}; pack can round f32 blocks with --precision f16 and do nothing else to "
        "blocks; pack the bundle that it was made from",
        file, type_name(from)));
  const ElementType to =
      options.precision.value_or(from == ElementType::f64 && options.low_rank ? ElementType::f32 : from);
  if (element_bytes(to) > element_bytes(from))
    throw InputError(fmt::format("{}: holds {}; {} would take more bytes and hold the same numbers", file,
                                 type_name(from), type_name(to)));
  if (options.low_rank && from == ElementType::f16)
    throw InputError(fmt::format(
        "{}: holds f16, whose rounding errors low rank cannot store; pack the bundle that it was made from", file));
  if (options.low_rank && to == ElementType::f64)
    throw InputError("--low-rank stores f32 or f16: its error is far above their rounding; leave --precision f64 out");
  return to;
}

// ---- what was measured ----------------------------------------------------------------------------------------------

// The accuracy that palpate-accuracy measured for a setting (mesh, element, storage ...), which a bundle made with that
// setting carries in its provenance: the keys that begin with "accuracy_" (formats/BUNDLE.md).
bool is_stated(const std::string& key) {
  return key.rfind("accuracy_", 0) == 0;
}

// stored: the form of the displacements, "f32", "f16" or "low-rank 0.001". Errors: InputError where the file is no flat
// JSON object of such keys, or was measured for another mesh, boundary, element or form.
nlohmann::json read_stated_accuracy(const std::filesystem::path& file, const nlohmann::json& provenance,
                                    const std::string& stored) {
  std::ifstream in(file);
  if (!in)
    throw InputError(fmt::format("{}: expected what palpate-accuracy choose wrote, found no file", file.string()));
  const auto stated = nlohmann::json::parse(in, nullptr, false);
  if (!stated.is_object() || stated.empty())
    throw InputError(
        fmt::format("{}: expected what palpate-accuracy choose wrote, a JSON object, found none", file.string()));
  for (const auto& [key, value] : stated.items())
    if (!is_stated(key) || !value.is_primitive() || value.is_null())
      throw InputError(
          fmt::format("{}: \"{}\": expected keys accuracy_... with a text, a number or a boolean each; "
                      "let palpate-accuracy choose write the file",
                      file.string(), key));
  const auto check = [&](const char* key, const std::string& found) {
    const std::string expected = stated.value(key, "");
    if (expected != found)
      throw InputError(
          fmt::format("{}: was measured with {} \"{}\", this bundle has \"{}\"; bake and pack it as "
                      "palpate-accuracy choose says",
                      file.string(), key + 9, expected, found));
  };
  for (const char* key : {"mesh_sha256", "boundary_sha256", "element"})
    check(fmt::format("accuracy_{}", key).c_str(), provenance.value(key, ""));
  check("accuracy_storage", stored);
  return stated;
}

// Removes the keys that an earlier form of the bundle carried.
void drop_stated_accuracy(nlohmann::json& provenance) {
  for (auto it = provenance.begin(); it != provenance.end();)
    it = is_stated(it.key()) ? provenance.erase(it) : std::next(it);
}

// ---- writing --------------------------------------------------------------------------------------------------------

class Packer {
 public:
  Packer(const BundleFile& source, const PackOptions& options, std::filesystem::path part)
      : source_(source),
        options_(options),
        part_(std::move(part)),
        columns_(source),
        type_(target_type(columns_, source, options)),
        kept_(kept_columns(source, options)),
        interior_(columns_.has_interior() && !options.surface) {
    const bool drops_interior = options.surface && columns_.has_interior();
    if (!options.accuracy.empty()) accuracy_ = read_stated_accuracy(options.accuracy, source.provenance(), form());
    if (type_ == columns_.type() && kept_.size() == columns_.columns() && !drops_interior && !options.low_rank &&
        options.accuracy.empty())
      throw InputError(fmt::format("{}: holds {}{} already; the options would change nothing", source.path().string(),
                                   columns_.form(), columns_.has_interior() ? "" : ", without an interior,"));
  }

  void write() {
    if (options_.low_rank) pack_blocks();
    if (columns_.in_blocks()) round_blocks();
    lay_out();
    copy_sections();
    write_displacements();
    seal_bundle(part_, entries_);
    measure();
    finish_provenance(part_, entries_, provenance_with_errors());
    seal_bundle(part_, entries_);
  }

  // What was done, for the reader.
  void report() const {
    const BundleFile packed(part_);
    const StoredColumns stored(packed);
    note(fmt::format("{}: {}; {} of {} touchable nodes{}; {} bytes, {:.1f} times smaller", options_.output.string(),
                     stored.form(), kept_.size(), columns_.columns(),
                     columns_.has_interior() ? interior_ ? ", with the interior" : ", without the interior" : "",
                     packed.index().header.file_bytes,
                     static_cast<double>(source_.index().header.file_bytes) /
                         static_cast<double>(packed.index().header.file_bytes)));
    if (blocks_) {
      note(
          fmt::format("{} blocks are stored with low rank (at most {}) and {} densely; {} more join parts that are far "
                      "apart, but low "
                      "rank would not make them smaller",
                      blocks_->low_rank_blocks, blocks_->largest_rank, blocks_->dense_blocks - blocks_->apart_but_dense,
                      blocks_->apart_but_dense));
      const std::uint64_t rows = 9 * kept_.size() * columns_.surface_nodes() * element_bytes(type_);
      if (blocks_->values.size() > rows / 2)
        warn(fmt::format(
            "low rank takes {} bytes and rows of the same type {}: on such a small surface low rank gains little",
            blocks_->values.size(), rows));
    }
    note(
        fmt::format("against its source, all {} columns: worst relative error {:.2g} (node {} dof {}), RMS {:.2g}, "
                    "largest error of an entry {:.2g}; against the solved columns at most {:.2g}",
                    errors_.columns, errors_.worst, errors_.worst_node, "xyz"[errors_.worst_dof], errors_.rms,
                    errors_.largest_entry, stored_error()));
    if (options_.low_rank && errors_.worst > *options_.low_rank)
      warn(fmt::format(
          "rounding to {1} takes the worst column above --low-rank {0}; use --precision f32, or allow a larger error",
          *options_.low_rank, type_name(type_)));
  }

 private:
  std::uint64_t columns() const { return kept_.size(); }

  // "f16", "low-rank 0.001"
  std::string form() const {
    return options_.low_rank ? fmt::format("low-rank {}", *options_.low_rank) : type_name(type_);
  }

  void pack_blocks() {
    const auto fixed = source_.numbers<std::uint8_t>(SectionId::fixed);
    const auto touchable = source_.numbers<std::int32_t>(SectionId::touchable);
    const auto stiffnesses = source_.numbers<double>(SectionId::force);
    const auto nodes = source_.numbers<double>(SectionId::nodes);
    ComplianceSource from;
    from.surface_nodes = static_cast<std::int32_t>(columns_.surface_nodes());
    from.position.assign(nodes.begin(), nodes.begin() + 3 * static_cast<std::ptrdiff_t>(from.surface_nodes));
    std::vector<Matrix3> own(columns());
    for (std::size_t s = 0; s < kept_.size(); ++s) {
      const std::size_t k = kept_[s];
      from.touchable.push_back(touchable[k]);
      Matrix3 stiffness;
      std::copy_n(stiffnesses.begin() + 9 * static_cast<std::ptrdiff_t>(k), 9, stiffness.begin());
      from.stiffness.insert(from.stiffness.end(), stiffness.begin(), stiffness.end());
      if (!invert_on_free(stiffness, &fixed[3 * static_cast<std::size_t>(touchable[k])], &own[s]))
        throw InputError(fmt::format("{}: tensors/force of node {} is not positive definite; run palpate-bundle verify",
                                     source_.path().string(), touchable[k]));
    }
    const MappedSurfaceRows rows(columns_);
    constexpr std::size_t kPagesInMemory = 256 << 20;  // bytes, about
    std::size_t read = 0;
    from.compliance = [&](std::size_t s, std::span<const std::int32_t> at, double* c) {
      // At most a page for each node and direction, and at most the column.
      read +=
          3 * std::min<std::size_t>(4096 * at.size(), 3 * columns_.surface_nodes() * element_bytes(columns_.type()));
      if (read > kPagesInMemory) rows.forget(), read = 0;
      for (std::size_t n = 0; n < at.size(); ++n) {
        const Matrix3 t = rows.entry(kept_[s], at[n]);
        for (std::size_t j = 0; j < 3; ++j)  // C_nk = T^u_nk C_kk
          for (std::size_t i = 0; i < 3; ++i)
            c[(j * at.size() + n) * 3 + i] =
                t[3 * i] * own[s][j] + t[3 * i + 1] * own[s][3 + j] + t[3 * i + 2] * own[s][6 + j];
      }
    };
    blocks_ = pack_compliance(from, {type_, options_.low_rank});
  }

  void round_blocks() {
    blocks_ = blocks_in_halves(columns_.blocks(), static_cast<const float*>(columns_.block_values()));
    blocks_->nodes = source_.numbers<std::int32_t>(SectionId::compliance_nodes);
    blocks_->cluster_ends = source_.numbers<std::int32_t>(SectionId::compliance_clusters);
    blocks_->blocks = source_.numbers<std::int32_t>(SectionId::compliance_blocks);
  }

  bool is_per_column(SectionId id) const {
    return id == SectionId::touchable || id == SectionId::force || id == SectionId::residual ||
           id == SectionId::iterations;
  }
  static bool is_displacement(SectionId id) {
    const auto number = static_cast<std::uint32_t>(id);
    return id == SectionId::displacement_surface || id == SectionId::displacement_interior ||
           (number >= static_cast<std::uint32_t>(SectionId::displacement_scale) &&
            number <= static_cast<std::uint32_t>(SectionId::compliance_scale));
  }

  void lay_out() {
    const BundleCounts& n = source_.index().counts;
    std::vector<SectionShape> shapes;
    std::size_t kinds = 0;
    const SectionDescription* known = section_descriptions(&kinds);
    for (std::size_t i = 0; i < kinds; ++i) {
      const SectionEntry* entry = source_.find(known[i].id);
      if (known[i].id == SectionId::provenance || is_displacement(known[i].id) || !entry) continue;
      std::vector<std::uint64_t> shape(entry->shape, entry->shape + entry->rank);
      if (is_per_column(known[i].id)) shape[0] = columns();
      shapes.push_back({known[i].id, shape, static_cast<ElementType>(entry->type)});
    }
    if (blocks_) {
      shapes.push_back({SectionId::compliance_nodes, {blocks_->nodes.size()}});
      shapes.push_back({SectionId::compliance_clusters, {blocks_->cluster_ends.size()}});
      shapes.push_back({SectionId::compliance_blocks, {blocks_->scale.size(), 5}});
      shapes.push_back({SectionId::compliance_values, {blocks_->values.size() / element_bytes(type_)}, type_});
      shapes.push_back({SectionId::compliance_scale, {blocks_->scale.size()}});
    } else {
      shapes.push_back({SectionId::displacement_surface, {columns(), 3, n.surface_nodes, 3}, type_});
    }
    if (interior_)
      shapes.push_back({SectionId::displacement_interior, {columns(), 3, n.nodes - n.surface_nodes, 3}, type_});
    if (type_ == ElementType::f16 && (!blocks_ || interior_))
      shapes.push_back({SectionId::displacement_scale, {columns(), 3}});
    entries_ = lay_out_bundle(part_, shapes, provenance_with_errors() + std::string(kRoomForNumbers, ' '));
  }

  const SectionEntry* entry(SectionId id) const {
    for (const SectionEntry& e : entries_)
      if (e.id == static_cast<std::uint32_t>(id)) return &e;
    return nullptr;
  }

  // Piece by piece: the corridor's rows may be as large as a store of columns.
  void copy_section(const SectionEntry& from, const SectionEntry& to, SectionWriter& writer) const {
    std::vector<char> piece(std::min<std::uint64_t>(from.bytes, 1 << 20));
    for (std::uint64_t at = 0; at < from.bytes; at += piece.size()) {
      const std::uint64_t count = std::min<std::uint64_t>(piece.size(), from.bytes - at);
      source_.read(from, at, piece.data(), count);
      writer.write(to, at, piece.data(), count);
    }
  }

  void copy_sections() {
    SectionWriter writer(part_);
    for (const SectionEntry& to : entries_) {
      const auto id = static_cast<SectionId>(to.id);
      if (id == SectionId::provenance || is_displacement(id)) continue;
      if (!is_per_column(id)) {
        copy_section(*source_.find(id), to, writer);
        continue;
      }
      const auto bytes = source_.numbers<char>(id);
      const std::size_t row = bytes.size() / columns_.columns();
      for (std::size_t s = 0; s < kept_.size(); ++s) writer.write(to, s * row, &bytes[kept_[s] * row], row);
    }
    if (!blocks_) return;
    const auto put = [&](SectionId id, const auto& numbers) {
      writer.write(*entry(id), 0, numbers.data(), numbers.size() * sizeof numbers[0]);
    };
    put(SectionId::compliance_nodes, blocks_->nodes);
    put(SectionId::compliance_clusters, blocks_->cluster_ends);
    put(SectionId::compliance_blocks, blocks_->blocks);
    put(SectionId::compliance_values, blocks_->values);
    put(SectionId::compliance_scale, blocks_->scale);
  }

  void write_displacements() {
    const SectionEntry *surface = entry(SectionId::displacement_surface),
                       *interior = entry(SectionId::displacement_interior),
                       *scales = entry(SectionId::displacement_scale);
    if (!surface && !interior) return;
    SectionWriter writer(part_);
    Progress progress("pack", columns());
    ColumnRows rows;
    for (std::size_t s = 0; s < kept_.size(); ++s) {
      columns_.read(kept_[s], rows);
      float scale[3] = {1, 1, 1};
      if (scales) {
        for (std::size_t j = 0; j < 3; ++j) scale[j] = row_scale(rows, j);
        writer.write(*scales, s * sizeof scale, scale, sizeof scale);
      }
      if (surface) write_rows(writer, *surface, s, rows.surface, scale);
      if (interior) write_rows(writer, *interior, s, rows.interior, scale);
      progress.advance();
    }
  }

  // One scale serves surface and interior.
  float row_scale(const ColumnRows& rows, std::size_t j) const {
    double largest = 0;
    for (const auto* part : {&rows.surface, &rows.interior}) {
      const std::size_t run = part->size() / 3;
      for (std::size_t i = 0; i < run; ++i) largest = std::max(largest, std::abs((*part)[j * run + i]));
    }
    return half_scale(largest);
  }

  void write_rows(SectionWriter& writer, const SectionEntry& to, std::size_t s, const std::vector<double>& numbers,
                  const float scale[3]) {
    bytes_.resize(numbers.size() * element_bytes(type_));
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (type_ == ElementType::f64) {
        std::memcpy(&bytes_[8 * i], &numbers[i], 8);
      } else if (type_ == ElementType::f32) {
        const auto number = static_cast<float>(numbers[i]);
        std::memcpy(&bytes_[4 * i], &number, 4);
      } else {
        const std::uint16_t half = half_of(numbers[i] / scale[i / (numbers.size() / 3)]);
        std::memcpy(&bytes_[2 * i], &half, 2);
      }
    }
    writer.write(to, s * bytes_.size(), bytes_.data(), bytes_.size());
  }

  // Measures the errors on the bytes that were written.
  void measure() {
    const BundleFile packed(part_);
    StoredColumns of_packed(packed);
    const auto touchable = source_.numbers<std::int32_t>(SectionId::touchable);
    Progress progress("measure", columns());
    ColumnRows stored, expected;
    for (std::size_t s = 0; s < kept_.size(); ++s) {
      of_packed.read(s, stored);
      columns_.read(kept_[s], expected);
      errors_.add(stored, expected, touchable[kept_[s]]);
      progress.advance();
    }
    errors_.finish();
  }

  // The error of the source against the solved columns: of an earlier pack, or of rounding when it was first stored.
  double source_error() const {
    const nlohmann::json p = source_.provenance();
    return number_of(p, "stored_error").value_or(number_of(p, "cast_error").value_or(0));
  }
  // |packed - solved| <= |packed - source| + |source - solved|, each relative to the column it is measured against.
  double stored_error() const {
    const double before = source_error();
    return before + (1 + before) * errors_.worst;
  }

  std::string done() const {
    std::string text = fmt::format("--precision {}", type_name(type_));
    if (options_.low_rank) text += fmt::format(" --low-rank {}", *options_.low_rank);
    if (options_.surface) text += " --surface";
    if (!options_.touchable.empty())
      text += fmt::format(" --touchable sha256 {}", sha256_of_file(options_.touchable.string()));
    for (const std::string& patch : options_.patches) text += " --patch " + patch;
    if (!options_.accuracy.empty()) text += " --accuracy";
    return text;
  }

  std::string provenance_with_errors() const {
    nlohmann::json p = source_.provenance();
    if (!p.is_object())
      throw InputError(
          fmt::format("{}: its provenance is no flat JSON object; run palpate-bundle verify", source_.path().string()));
    drop_stated_accuracy(p);
    if (accuracy_.is_object()) p.update(accuracy_);
    const std::string before = p.value("pack_history", "");
    p["version"] = layout_of_element(p.value("element", ""));
    p["packed_from_sha256"] = source_sha256_;
    p["pack_history"] = fmt::format("{}{}palpate-bundle {} pack {} of sha256 {}", before, before.empty() ? "" : "; ",
                                    PALPATE_VERSION, done(), source_sha256_);
    p["pack_error_worst"] = errors_.worst;
    p["pack_error_worst_node"] = errors_.worst_node;
    p["pack_error_worst_dof"] = errors_.worst_dof;
    p["pack_error_rms"] = errors_.rms;
    p["pack_error_entry"] = errors_.largest_entry;
    p["stored_error"] = stored_error();
    if (kept_.size() < columns_.columns()) keep_certificate(p);
    return p.dump();
  }

  // The worst of the columns that are kept.
  void keep_certificate(nlohmann::json& p) const {
    const auto touchable = source_.numbers<std::int32_t>(SectionId::touchable);
    const auto residual = source_.numbers<double>(SectionId::residual);
    const auto iterations = source_.numbers<std::int32_t>(SectionId::iterations);
    double worst = -1;
    std::int64_t node = -1, dof = 0, most = 0;
    for (const std::size_t k : kept_)
      for (std::size_t j = 0; j < 3; ++j) {
        if (residual[3 * k + j] > worst) worst = residual[3 * k + j], node = touchable[k], dof = static_cast<int>(j);
        most = std::max<std::int64_t>(most, iterations[3 * k + j]);
      }
    if (p.contains("worst_residual")) p["worst_residual"] = worst;
    if (p.contains("worst_column_node")) p["worst_column_node"] = node;
    if (p.contains("worst_column_dof")) p["worst_column_dof"] = dof;
    if (p.contains("most_iterations")) p["most_iterations"] = most;
  }

  const BundleFile& source_;
  const PackOptions& options_;
  std::filesystem::path part_;
  StoredColumns columns_;
  ElementType type_;
  std::vector<std::size_t> kept_;
  bool interior_;
  nlohmann::json accuracy_;  // what is to be stated, if anything
  std::string source_sha256_ = sha256_of_file(source_.path().string());
  std::optional<PackedCompliance> blocks_;
  std::vector<SectionEntry> entries_;
  std::vector<char> bytes_;
  ColumnErrors errors_;
};

}  // namespace

void check_low_rank(double value) {
  if (!(value >= 1e-6 && value <= 0.1))
    throw InputError(fmt::format("--low-rank: expected a relative column error from 1e-6 to 0.1, found {}", value));
}

void pack_bundle_into(const PackOptions& options, const std::filesystem::path& part) {
  const BundleFile source(options.bundle);
  Packer packer(source, options, part);
  packer.write();
  packer.report();
}

void pack_bundle(const PackOptions& options) {
  check_options(options);
  AtomicFile file(options.output);
  pack_bundle_into(options, file.part());
  file.commit();
}

}  // namespace palpate
