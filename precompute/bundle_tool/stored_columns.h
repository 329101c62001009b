// Reads the displacements of a bundle as numbers, column by column, in whatever form they are stored.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "formats/checksum.h"
#include "formats/compliance_blocks.h"
#include "precompute/bundle_tool/bundle_file.h"

namespace palpate {

// T^u of the three columns of one touchable node.
struct ColumnRows {
  std::vector<double> surface;   // [3][Ns][3]
  std::vector<double> interior;  // [3][N-Ns][3]; empty where it is not stored
};

class StoredColumns {
 public:
  // Keeps in memory one column of stored rows, or all blocks of a compliance. Errors: InputError where the tables of
  // the compliance do not hold.
  explicit StoredColumns(const BundleFile& file);

  std::size_t columns() const { return columns_; }  // touchable nodes
  std::uint64_t surface_nodes() const { return file_.index().counts.surface_nodes; }
  bool has_interior() const { return interior_ != nullptr; }

  // T^u of the k-th touchable node. Errors: OperationError when the file cannot be read.
  void read(std::size_t k, ColumnRows& rows);

  // XXH64 of each displacement section of which read() has read every column once, from first to last.
  std::map<formats::SectionId, std::uint64_t> checksums() const;

  // "f32 rows", "f16 rows with scales", "f32 compliance blocks (2193, 844 dense)".
  std::string form() const;
  formats::ElementType type() const { return type_; }
  bool in_blocks() const { return !blocks_.empty(); }
  std::size_t block_count() const { return blocks_.size(); }
  const std::vector<formats::ComplianceBlock>& blocks() const { return blocks_; }
  const void* block_values() const { return values_.data(); }  // of all blocks, of type()
  std::size_t dense_blocks() const;
  const BundleFile& file() const { return file_; }
  // What a stored number of row [k, j] is multiplied by.
  double row_scale(std::size_t k, std::size_t j) const { return scale_.empty() ? 1.0 : scale_[3 * k + j]; }

  // How far rounding to the stored type may move a number of row [k, j]: relative to the number, and absolutely. Both
  // are 0 for f64, and for blocks, whose numbers are symmetric by construction.
  double relative_rounding() const;
  double absolute_rounding(std::size_t k, int j) const;

 private:
  struct Rows {
    const formats::SectionEntry* entry;
    std::uint64_t next = 0;  // column that the checksum expects
    formats::Xxh64 checksum;
  };
  void read_rows(Rows& rows, std::size_t k, std::vector<double>& out);
  void read_blocks(std::size_t k, std::vector<double>& out) const;

  const BundleFile& file_;
  std::size_t columns_;
  const formats::SectionEntry *surface_, *interior_;
  formats::ElementType type_;
  Rows surface_rows_, interior_rows_;
  std::vector<float> scale_;
  std::vector<char> buffer_;
  // of a compliance
  std::vector<formats::ComplianceBlock> blocks_;
  std::vector<std::int32_t> nodes_, position_of_column_;
  std::vector<char> values_;
  std::vector<double> stiffness_;
};

// The surface's rows, mapped, so that single entries are found fast and the system may drop what it has read.
class MappedSurfaceRows {
 public:
  // columns: with rows, not blocks. Errors: OperationError where the file cannot be mapped.
  explicit MappedSurfaceRows(const StoredColumns& columns);
  ~MappedSurfaceRows();
  MappedSurfaceRows(const MappedSurfaceRows&) = delete;
  MappedSurfaceRows& operator=(const MappedSurfaceRows&) = delete;

  // T^u of the k-th touchable node at a surface node, row-major: out[3 i + j] is dof i for a unit displacement of dof j.
  std::array<double, 9> entry(std::size_t k, std::int32_t node) const;
  // Lets go of the pages that were read; the next read maps them again.
  void forget() const;

 private:
  const StoredColumns& columns_;
  void* map_ = nullptr;
  std::size_t map_bytes_ = 0;
  const char* rows_ = nullptr;
};

}  // namespace palpate
