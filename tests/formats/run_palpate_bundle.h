// Runs palpate-bundle and palpate-precompute as users do, on files of one test alone.
#pragma once

#include <algorithm>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "tests/support/box_files.h"
#include "tests/support/bundle_parts.h"
#include "tests/support/program_run.h"

namespace palpate::tests {

inline void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

// Must end with that code.
inline ProgramRun palpate_bundle(const std::string& arguments, int code = 0) {
  const ProgramRun ended = run_in(fresh_folder(), PALPATE_BUNDLE_PROGRAM " " + arguments);
  EXPECT_EQ(ended.code, code) << arguments << "\n" << ended.out << ended.errors;
  return ended;
}

inline nlohmann::json info_of(const std::string& bundle) {
  return nlohmann::json::parse(palpate_bundle("info --json " + bundle).out);
}

// The check of that name in verify's report; null where there is none.
inline nlohmann::json check_of(const std::string& bundle, const std::string& name, int code) {
  const auto report = nlohmann::json::parse(palpate_bundle("verify --json " + bundle, code).out);
  EXPECT_EQ(report["held"], code == 0);
  for (const auto& check : report["checks"])
    if (check["name"] == name) return check;
  return {};
}

// A box of tissue held at x0 and at a corner: mesh, organ and boundary of this test. store: "" or a [store] table.
inline void write_inputs(const std::string& store = "") {
  auto mesh = box_mesh({4, 3, 3}, {60, 50, 40}, 0.1);
  write_mesh(scratch("msh"), mesh);
  write_bytes(scratch("organ.toml"), kOrgan);
  write_bytes(scratch("boundary.toml"), R"(
name = "face"
[[fixed]]
dofs = "xyz"
select = { patch = "x0" }
[[fixed]]
dofs = "y"
select = { nearest = { points = [[60, 50, 40]] } }
)" + store);
}

inline std::string precompute() {
  const std::string bundle = scratch("computed.h5");
  const ProgramRun ended = run_in(fresh_folder(), PALPATE_PRECOMPUTE_PROGRAM " " + scratch("msh").string() +
                                                      " --organ " + scratch("organ.toml").string() + " --boundary " +
                                                      scratch("boundary.toml").string() + " -o " + bundle);
  EXPECT_EQ(ended.code, 0) << ended.errors;
  return bundle;
}

// Verifies the bundle against the files of write_inputs(), and prints JSON.
inline ProgramRun verify_with_inputs(const std::string& bundle, int code, int columns = 5) {
  return palpate_bundle("verify --json " + bundle + " --mesh " + scratch("msh").string() + " --organ " +
                            scratch("organ.toml").string() + " --boundary " + scratch("boundary.toml").string() +
                            " --columns " + std::to_string(columns) + " --seed 3",
                        code);
}

// The parts, with the numbers of one section changed.
template <class Number, class Change>
BundleParts changed(BundleParts parts, formats::SectionId id, const Change& change) {
  auto numbers = parts.get<Number>(id);
  change(numbers);
  parts.set(id, parts.sections.at(id).shape, numbers);
  return parts;
}

// A sealed bundle whose bytes a test changes.
struct OpenedBundle {
  std::string file, bytes = file_bytes(file);
  std::vector<formats::SectionEntry> entries = [this] {
    std::vector<formats::SectionEntry> result(info_of(file)["sections"].size());
    std::memcpy(result.data(), bytes.data() + sizeof(formats::BundleHeader),
                result.size() * sizeof(formats::SectionEntry));
    return result;
  }();

  const formats::SectionEntry& section(formats::SectionId id) const {
    return *std::find_if(entries.begin(), entries.end(), [&](const formats::SectionEntry& entry) {
      return entry.id == static_cast<std::uint32_t>(id);
    });
  }
  template <class Number>
  Number get(std::uint64_t offset) const {
    Number number;
    std::memcpy(&number, bytes.data() + offset, sizeof number);
    return number;
  }
  template <class Number>
  void scale(std::uint64_t offset, Number factor) {
    const Number scaled = factor * get<Number>(offset);
    std::memcpy(bytes.data() + offset, &scaled, sizeof scaled);
  }
  void write() const {
    write_bytes(file, bytes);
    seal_bundle(file, entries);
  }
};

}  // namespace palpate::tests
