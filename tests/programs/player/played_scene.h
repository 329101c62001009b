// Runs palpate-run in a folder of the test's own, on the box bundle and a scene that the test writes.
#pragma once

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/test_files.h"
#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

struct Ended {
  int code;
  std::string errors, output;
};

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

  Ended run(const std::string& arguments) {
    const std::string command = std::string("cd '") + folder_.string() + "' && '" + PALPATE_RUN + "' " + arguments +
                                " > stdout.txt 2> stderr.txt";
    const int status = std::system(command.c_str());
    return {WEXITSTATUS(status), read_text(folder_ / "stderr.txt"), read_text(folder_ / "stdout.txt")};
  }

  void expect_refused(const std::string& arguments, const std::string& part_of_sentence) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.code, 2) << ended.errors;
    EXPECT_THAT(ended.errors, testing::HasSubstr(part_of_sentence));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out.part"));
  }

  std::filesystem::path folder_;
};

}  // namespace palpate::tests
