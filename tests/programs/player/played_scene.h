// Runs palpate-run in a folder of the test's own, on the box bundle and a scene that the test writes.
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "tests/programs/player/csv_rows.h"
#include "tests/support/program_run.h"
#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

// The box of the bundle is 60 x 50 x 40 mm, held at x = 0. The probe comes down on its top.
inline const std::string kProbe =
    "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0]]\npath = [[0, 41, 26, 44], [0.1, 41, 26, 35]]\n";

class PlayedScene : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fresh_folder();
    write_bundle(folder_ / "box.h5", tiny_bundle());
  }

  void write_scene(const std::string& tools, const std::string& head = "") {
    std::ofstream(folder_ / "scene.toml") << "name = \"test\"\nbundle = \"box.h5\"\nunit = \"mm\"\n" << head << tools;
  }

  // With all digits of each double, unless the arguments say otherwise, so that a test may compare bits.
  ProgramRun run(const std::string& arguments) {
    const bool says = arguments.find("--digits") != std::string::npos;
    return run_in(folder_, std::string("'") + PALPATE_RUN + "' " + arguments + (says ? "" : " --digits 17"));
  }
  // A run that must end well.
  ProgramRun played(const std::string& arguments) {
    const ProgramRun ended = run(arguments);
    if (ended.code != 0) throw std::runtime_error(arguments + ": " + ended.errors);
    return ended;
  }
  // What the scene's record gives again: itself, and the same bytes of these files.
  void expect_replayed(std::initializer_list<const char*> files) {
    played("scene.toml -o out --record run.record");
    played("--replay run.record");
    played("scene.toml --replay run.record");
    played("run.record -o again --record again.record");
    EXPECT_EQ(file_bytes(folder_ / "again.record"), file_bytes(folder_ / "run.record"));
    for (const char* file : files)
      EXPECT_EQ(file_bytes(folder_ / "again" / file), file_bytes(folder_ / "out" / file)) << file;
  }
  nlohmann::json summary_of(const std::string& folder = "out") const {
    return nlohmann::json::parse(file_bytes(folder_ / folder / "summary.json"));
  }
  std::vector<Row> rows_of(const std::string& file) const { return read_rows(folder_ / file); }

  void expect_refused(const std::string& arguments, const std::string& part_of_sentence) {
    const ProgramRun ended = run(arguments);
    EXPECT_EQ(ended.code, 2) << ended.errors;
    EXPECT_THAT(ended.errors, testing::HasSubstr(part_of_sentence));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out.part"));
  }

  std::filesystem::path folder_;
};

}  // namespace palpate::tests
