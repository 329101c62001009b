// Compares the tables of formats/BUNDLE.md with the layout and the section list.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>

#include "formats/bundle_reader.h"
#include "formats/element_layout.h"

namespace palpate::formats {
namespace {

std::string document() {
  std::ifstream in(PALPATE_SOURCE_FOLDER "/formats/BUNDLE.md");
  return {std::istreambuf_iterator<char>(in), {}};
}

// "f64, f32, f16": the types that the section may have, in the order of the type numbers.
std::string names_of(std::uint32_t types) {
  constexpr const char* names[] = {"", "f64", "f32", "i32", "u8", "text", "f16"};
  std::string list;
  for (std::uint32_t t = 0; t < std::size(names); ++t)
    if (types >> t & 1u) list += (list.empty() ? "" : ", ") + std::string(names[t]);
  return list;
}

TEST(BundleDocument, ListsEverySectionAsTheSectionListDoes) {
  std::ostringstream table;
  table << "| id | dataset | type | shape | unit | presence | meaning |\n|---|---|---|---|---|---|---|\n";
  std::size_t count = 0;
  const SectionDescription* sections = section_descriptions(&count);
  for (std::size_t i = 0; i < count; ++i) {
    std::string meaning = sections[i].meaning;
    for (std::size_t at = 0; (at = meaning.find('|', at)) != std::string::npos; at += 2) meaning.insert(at, 1, '\\');
    table << "| " << static_cast<std::uint32_t>(sections[i].id) << " | `" << sections[i].path << "` | "
          << names_of(sections[i].types) << " | " << sections[i].shape << " | " << sections[i].unit << " | "
          << (sections[i].always ? "always" : "optional") << " | " << meaning << " |\n";
  }
  EXPECT_NE(document().find(table.str()), std::string::npos) << "formats/BUNDLE.md must hold this table:\n"
                                                             << table.str();
}

TEST(BundleDocument, GivesTheOffsetsOfTheStructs) {
  const auto row = [](const char* name, std::size_t offset, std::size_t bytes) {
    std::ostringstream expected_row;
    expected_row << "| " << offset << " | " << bytes << " | `" << name << "` |";
    const std::string expected = expected_row.str();
    EXPECT_NE(document().find(expected), std::string::npos) << expected;
  };
#define ROW(Struct, member) row(#member, offsetof(Struct, member), sizeof(Struct::member))
  ROW(BundleHeader, magic);
  ROW(BundleHeader, layout_version);
  ROW(BundleHeader, section_count);
  ROW(BundleHeader, file_bytes);
  ROW(BundleHeader, user_block_bytes);
  ROW(BundleHeader, index_checksum);
  ROW(BundleHeader, reserved);
  ROW(SectionEntry, id);
  ROW(SectionEntry, type);
  ROW(SectionEntry, rank);
  ROW(SectionEntry, reserved);
  ROW(SectionEntry, shape);
  ROW(SectionEntry, offset);
  ROW(SectionEntry, bytes);
  ROW(SectionEntry, checksum);
#undef ROW
  for (const auto layout : {kLayoutVersion, kNewestLayout})
    EXPECT_NE(document().find("### Layout " + std::to_string(layout)), std::string::npos)
        << "the history must tell of the layouts that are written";
}

TEST(SectionList, NeverUsesAnIdOrAPathTwice) {
  std::size_t count = 0;
  const SectionDescription* sections = section_descriptions(&count);
  ASSERT_LE(count, kMaxSections);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_NE(sections[i].id, sections[j].id) << sections[i].path;
      EXPECT_STRNE(sections[i].path, sections[j].path);
    }
}

}  // namespace
}  // namespace palpate::formats
