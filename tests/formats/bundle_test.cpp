#include <gtest/gtest.h>
#include <hdf5.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "formats/bundle_reader.h"
#include "formats/bundle_writer.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "tests/support/test_files.h"
#include "tests/support/tiny_bundle.h"

namespace palpate {
namespace {

using namespace formats;
using tests::BundleParts;
using tests::file_bytes;
using tests::scratch;

const BundleParts& box() {
  static const BundleParts parts = tests::tiny_bundle({.cells = {2, 2, 2}});
  return parts;
}

TEST(Bundle, HoldsWhatWasWrittenAtTheOffsetsOfItsIndex) {
  const auto file = scratch("h5");
  write_bundle(file, box());
  const std::string bytes = file_bytes(file);
  BundleIndex index;
  BundleError error;
  ASSERT_EQ(read_bundle_index(bytes.data(), bytes.size(), &index, &error), BundleStatus::ok) << error.text;
  EXPECT_EQ(index.header.section_count, box().sections.size() + 1);
  for (const auto& [id, part] : box().sections) {
    const SectionEntry* entry = find_section(index, id);
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(bytes.substr(entry->offset, entry->bytes), part.bytes) << describe_section(id)->path;
    EXPECT_EQ(entry->checksum, xxh64(part.bytes.data(), part.bytes.size()));
  }
  const SectionEntry* provenance = find_section(index, SectionId::provenance);
  EXPECT_EQ(bytes.substr(provenance->offset, provenance->bytes), box().provenance);
}

TEST(Bundle, IsTheSameBytesWhenWrittenTwice) {
  const auto first = scratch("a.h5"), second = scratch("b.h5");
  write_bundle(first, box());
  write_bundle(second, box());
  EXPECT_EQ(file_bytes(first), file_bytes(second));
}

// An element that readers of layout 2 would take for p1-anp has a layout that they refuse.
TEST(Bundle, HasTheLayoutOfItsElement) {
  const auto folder = tests::fresh_folder();
  for (const auto& [element, layout] : {std::pair{"p1", 2u}, {"p1-anp", 2u}, {"p1-ang", 3u}, {"p2-p0", 2u}}) {
    BundleParts parts = box();
    parts.provenance = std::string(R"({"element": ")") + element + "\"}";
    write_bundle(folder / "bundle.h5", parts);
    BundleHeader header;
    std::ifstream(folder / "bundle.h5").read(reinterpret_cast<char*>(&header), sizeof header);
    EXPECT_EQ(header.layout_version, layout) << element;
  }
  std::filesystem::remove_all(folder);
}

TEST(Bundle, ReadsTheSameNumbersThroughHdf5) {
  const auto path = scratch("h5");
  write_bundle(path, box());
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  for (const auto& [id, part] : box().sections) {
    const SectionDescription* section = describe_section(id);
    const hid_t data = H5Dopen2(file, section->path, H5P_DEFAULT);
    ASSERT_GE(data, 0) << section->path;
    const hid_t type = H5Dget_type(data), space = H5Dget_space(data);
    std::string bytes(H5Tget_size(type) * static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)), '\0');
    EXPECT_GE(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), 0);
    EXPECT_EQ(bytes, part.bytes) << section->path;
    if (part.type == ElementType::f64) {
      EXPECT_GT(H5Tequal(type, H5T_NATIVE_DOUBLE), 0);
    }
    if (part.type == ElementType::i32) {
      EXPECT_GT(H5Tequal(type, H5T_NATIVE_INT32), 0);
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Dclose(data);
  }
  H5Fclose(file);
}

// A number attribute of an object of the file; NaN when it is not there.
double attribute(hid_t file, const char* object, const char* name) {
  double value = std::nan("");
  const hid_t attribute = H5Aopen_by_name(file, object, name, H5P_DEFAULT, H5P_DEFAULT);
  if (attribute < 0) return value;
  H5Aread(attribute, H5T_NATIVE_DOUBLE, &value);
  H5Aclose(attribute);
  return value;
}

TEST(Bundle, TakesNumbersThatAreKnownOnlyAfterTheTensors) {
  const auto path = scratch("h5");
  std::vector<SectionShape> shapes;
  for (const auto& [id, part] : box().sections) shapes.push_back({id, part.shape, part.type});
  const std::string before = R"({"organ": "box", "worst_residual": 0.0, "most_iterations": 0})";
  const std::string after = R"({"organ": "box", "worst_residual": 1.5e-13, "most_iterations": 2})";
  const auto entries = lay_out_bundle(path, shapes, before + std::string(20, ' '));
  const std::uintmax_t laid_out = std::filesystem::file_size(path);
  finish_provenance(path, entries, after);
  EXPECT_EQ(std::filesystem::file_size(path), laid_out);

  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  for (const char* object : {".", "certificate"}) {
    EXPECT_EQ(attribute(file, object, "worst_residual"), 1.5e-13);
    EXPECT_EQ(attribute(file, object, "most_iterations"), 2.0);
  }
  H5Fclose(file);
  for (const SectionEntry& entry : entries)
    if (entry.id == static_cast<std::uint32_t>(SectionId::provenance)) {
      EXPECT_EQ(file_bytes(path).substr(entry.offset, after.size()), after);
    }
  EXPECT_THROW(finish_provenance(path, entries, after + std::string(100, ' ')), InputError);
}

TEST(Bundle, IsNotLaidOutFromShapesOrTextsThatContradictTheList) {
  const auto path = scratch("h5");
  const std::string provenance = R"({"format": "palpate bundle"})";
  const auto lay_out = [&](SectionShape shape, const std::string& text) {
    lay_out_bundle(path, {std::move(shape)}, text);
  };
  EXPECT_THROW(lay_out({SectionId::nodes, {3}}, provenance), InputError);
  EXPECT_THROW(lay_out({SectionId::nodes, {0, 3}}, provenance), InputError);
  EXPECT_THROW(lay_out({SectionId::nodes, {std::uint64_t{1} << 32, 3}}, provenance), InputError);
  EXPECT_THROW(lay_out({static_cast<SectionId>(999), {3}}, provenance), InputError);
  EXPECT_THROW(lay_out({SectionId::nodes, {4, 3}}, "no json"), InputError);
  EXPECT_THROW(lay_out({SectionId::nodes, {4, 3}}, R"({"list": [1, 2]})"), InputError);
  EXPECT_THROW(lay_out_bundle("/nowhere/a.h5", {}, provenance), OperationError);
}

TEST(Bundle, IsNotSealedWhenItsSectionsDoNotHoldTogether) {
  const auto path = scratch("h5");
  const auto entries = lay_out_bundle(path, {{SectionId::nodes, {4, 3}}}, R"({"format": "palpate bundle"})");
  EXPECT_THROW(seal_bundle(path, entries), OperationError);
  BundleIndex index;
  const std::string bytes = file_bytes(path);
  EXPECT_EQ(read_bundle_index(bytes.data(), bytes.size(), &index, nullptr), BundleStatus::magic);
}

}  // namespace
}  // namespace palpate
