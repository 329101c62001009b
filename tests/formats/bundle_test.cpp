#include <gtest/gtest.h>
#include <hdf5.h>

#include <fstream>
#include <iterator>

#include "formats/bundle_reader.h"
#include "formats/bundle_writer.h"
#include "formats/checksum.h"
#include "formats/errors.h"
#include "tests/support/tiny_bundle.h"

namespace palpate {
namespace {

using namespace formats;
using tests::BundleParts;

// A file name of this test alone, so that tests can run side by side.
std::filesystem::path scratch(const std::string& name) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  return std::filesystem::path(testing::TempDir()) /
         (std::string(test->test_suite_name()) + "." + test->name() + "." + name);
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

const BundleParts& box() {
  static const BundleParts parts = tests::tiny_bundle({.cells = {2, 2, 2}});
  return parts;
}

TEST(Bundle, HoldsWhatWasWrittenAtTheOffsetsOfItsIndex) {
  const auto file = scratch("h5");
  write_bundle(file, box());
  const std::string bytes = bytes_of(file);
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
  EXPECT_EQ(bytes_of(first), bytes_of(second));
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
    if (section->type == ElementType::f64) {
      EXPECT_GT(H5Tequal(type, H5T_NATIVE_DOUBLE), 0);
    }
    if (section->type == ElementType::i32) {
      EXPECT_GT(H5Tequal(type, H5T_NATIVE_INT32), 0);
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Dclose(data);
  }
  H5Fclose(file);
}

}  // namespace
}  // namespace palpate
