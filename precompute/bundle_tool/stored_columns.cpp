#include "precompute/bundle_tool/stored_columns.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace palpate {

using namespace formats;

namespace {

ElementType type_of(const SectionEntry& entry) {
  return static_cast<ElementType>(entry.type);
}

}  // namespace

StoredColumns::StoredColumns(const BundleFile& file)
    : file_(file),
      columns_(file.index().counts.touchable),
      surface_(file.find(SectionId::displacement_surface)),
      interior_(file.find(SectionId::displacement_interior)),
      type_(type_of(surface_ ? *surface_ : *file.find(SectionId::compliance_values))),
      surface_rows_{surface_, 0, {}},
      interior_rows_{interior_, 0, {}},
      scale_(file.numbers<float>(SectionId::displacement_scale)) {
  if (surface_) return;
  nodes_ = file.numbers<std::int32_t>(SectionId::compliance_nodes);
  const auto ends = file.numbers<std::int32_t>(SectionId::compliance_clusters);
  const auto stored = file.numbers<std::int32_t>(SectionId::compliance_blocks);
  const auto scale = file.numbers<float>(SectionId::compliance_scale);
  const auto touchable = file.numbers<std::int32_t>(SectionId::touchable);
  values_ = file.numbers<char>(SectionId::compliance_values);
  stiffness_ = file.numbers<double>(SectionId::force);
  IndexedSections sections;
  sections.touchable = touchable.data();
  sections.compliance_nodes = nodes_.data(), sections.compliance_clusters = ends.data();
  sections.compliance_blocks = stored.data(), sections.compliance_scale = scale.data();
  BundleError error;
  if (check_stored_indices(file.index(), sections, &error) != BundleStatus::ok)
    throw InputError(fmt::format("{}: byte {}: {}", file.path().string(), error.byte_offset, error.text));
  std::uint64_t first = 0;
  for (std::size_t b = 0; b < scale.size(); ++b) {
    StoredBlock s;
    std::memcpy(&s, &stored[5 * b], sizeof s);
    blocks_.push_back(placed_block(s, ends.data(), first, scale[b]));
    first += blocks_.back().numbers();
  }
  std::vector<std::int32_t> position(nodes_.size(), -1);
  for (std::size_t p = 0; p < nodes_.size(); ++p) position[nodes_[p]] = static_cast<std::int32_t>(p);
  for (const auto node : touchable) position_of_column_.push_back(position[node]);
}

void StoredColumns::read(std::size_t k, ColumnRows& rows) {
  if (surface_)
    read_rows(surface_rows_, k, rows.surface);
  else
    read_blocks(k, rows.surface);
  rows.interior.clear();
  if (interior_) read_rows(interior_rows_, k, rows.interior);
}

void StoredColumns::read_rows(Rows& rows, std::size_t k, std::vector<double>& out) {
  const std::size_t run = 3 * rows.entry->shape[2];
  const ElementType type = type_of(*rows.entry);
  buffer_.resize(3 * run * element_bytes(type));
  file_.read(*rows.entry, k * buffer_.size(), buffer_.data(), buffer_.size());
  if (rows.next == k) {
    rows.checksum.update(buffer_.data(), buffer_.size());
    ++rows.next;
  }
  out.resize(3 * run);
  for (std::size_t j = 0; j < 3; ++j) {
    const double scale = row_scale(k, j);
    for (std::size_t i = 0; i < run; ++i) out[j * run + i] = scale * stored_number(type, buffer_.data(), j * run + i);
  }
}

// T^u_nk = C_nk T^f_k, from the blocks that contain column k, or row k, of the compliance.
void StoredColumns::read_blocks(std::size_t k, std::vector<double>& out) const {
  const std::size_t run = 3 * surface_nodes();
  out.assign(3 * run, 0.0);
  const double* stiffness = &stiffness_[9 * k];
  const std::int32_t own = position_of_column_[k];
  const auto put = [&](std::int32_t position, const double* c, bool transposed) {
    const std::size_t at = 3 * static_cast<std::size_t>(nodes_[position]);
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i)
        for (int m = 0; m < 3; ++m)
          out[j * run + at + i] += c[transposed ? 3 * m + i : 3 * i + m] * stiffness[3 * m + j];
  };
  double c[9];
  for (const ComplianceBlock& block : blocks_) {
    if (own >= block.column && own < block.column + block.columns) {
      for (std::int32_t r = 0; r < block.rows; ++r) {
        block.entry(type_, values_.data(), r, own - block.column, c);
        put(block.row + r, c, false);
      }
    } else if (own >= block.row && own < block.row + block.rows) {
      for (std::int32_t s = 0; s < block.columns; ++s) {
        block.entry(type_, values_.data(), own - block.row, s, c);
        put(block.column + s, c, true);
      }
    }
  }
}

std::map<SectionId, std::uint64_t> StoredColumns::checksums() const {
  std::map<SectionId, std::uint64_t> sums;
  for (const Rows* rows : {&surface_rows_, &interior_rows_})
    if (rows->entry && rows->next == rows->entry->shape[0])
      sums[static_cast<SectionId>(rows->entry->id)] = rows->checksum.digest();
  return sums;
}

std::size_t StoredColumns::dense_blocks() const {
  return static_cast<std::size_t>(
      std::count_if(blocks_.begin(), blocks_.end(), [](const ComplianceBlock& b) { return b.rank == 0; }));
}

std::string StoredColumns::form() const {
  const std::string type = type_name(type_);
  if (in_blocks())
    return fmt::format("{} compliance in {} blocks, {} of them dense", type, block_count(), dense_blocks());
  return type + (type_ == ElementType::f16 ? " rows with a scale each" : " rows");
}

double StoredColumns::relative_rounding() const {
  if (in_blocks() || type_ == ElementType::f64) return 0;
  return type_ == ElementType::f32 ? 0x1p-24 : 0x1p-11;
}

double StoredColumns::absolute_rounding(std::size_t k, int j) const {
  return !in_blocks() && type_ == ElementType::f16 ? 0x1p-25 * scale_[3 * k + static_cast<std::size_t>(j)] : 0;
}

MappedSurfaceRows::MappedSurfaceRows(const StoredColumns& columns) : columns_(columns) {
  const SectionEntry& entry = *columns.file().find(SectionId::displacement_surface);
  const std::uint64_t before = entry.offset % static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  map_bytes_ = entry.bytes + before;
  map_ = ::mmap(nullptr, map_bytes_, PROT_READ, MAP_PRIVATE, columns.file().descriptor(),
                static_cast<off_t>(entry.offset - before));
  if (map_ == MAP_FAILED)
    throw OperationError(fmt::format("{}: cannot be mapped: {}", columns.file().path().string(), std::strerror(errno)));
  rows_ = static_cast<const char*>(map_) + before;
}

MappedSurfaceRows::~MappedSurfaceRows() {
  ::munmap(map_, map_bytes_);
}

void MappedSurfaceRows::forget() const {
  static_cast<void>(::madvise(map_, map_bytes_, MADV_DONTNEED));  // where it fails, the pages stay
}

std::array<double, 9> MappedSurfaceRows::entry(std::size_t k, std::int32_t node) const {
  const std::size_t run = 3 * columns_.surface_nodes(), at = 3 * static_cast<std::size_t>(node);
  std::array<double, 9> t;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      t[3 * i + j] = columns_.row_scale(k, j) * stored_number(columns_.type(), rows_, (3 * k + j) * run + at + i);
  return t;
}

}  // namespace palpate
