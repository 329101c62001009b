// Runs palpate-bundle pack as users do: what it writes, states and refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/bundle_reader.h"
#include "tests/formats/run_palpate_bundle.h"
#include "tests/support/tiny_bundle.h"

namespace palpate {
namespace {

using namespace tests;
using formats::SectionId;
using testing::HasSubstr;

// Long enough for low rank; with its interior.
std::string box_file(bool interior = true) {
  const auto file = scratch(interior ? "box.h5" : "surface.h5");
  write_bundle(
      file, tiny_bundle({.cells = {14, 3, 3}, .size = {0.28, 0.06, 0.06}, .interior = interior, .single_dof = true}));
  return file.string();
}

std::string packed(const std::string& bundle, const std::string& options, const std::string& name = "packed.h5") {
  const std::string file = scratch(name).string();
  palpate_bundle("pack " + bundle + " -o " + file + " " + options);
  return file;
}

// The sentence with which pack refuses; it writes nothing.
std::string refused(const std::string& arguments) {
  const ProgramRun ended = palpate_bundle("pack " + arguments + " -o " + scratch("out.h5").string(), 2);
  EXPECT_FALSE(std::filesystem::exists(scratch("out.h5"))) << arguments;
  return ended.errors;
}

std::string type_of(const nlohmann::json& report, const std::string& path) {
  for (const auto& section : report["sections"])
    if (section["path"] == path) return section["type"];
  return "";
}

TEST(PalpateBundlePack, StatesTheErrorThatDiffFinds) {
  const std::string source = box_file();
  const struct {
    const char *options, *surface, *interior;
    double least, most;  // of the worst column
  } forms[] = {
      // The error of an entry, and so of a column, is at most half a unit in the last of 11 bits; random numbers reach a
      // third of it.
      {"--precision f16", "f16", "f16", 1e-4, 4.9e-4},
      {"--precision f16 --surface", "f16", "", 1e-4, 4.9e-4},
      {"--low-rank 1e-4 --surface", "", "", 1e-6, 1e-4},
      {"--low-rank 1e-2 --precision f16", "", "f16", 1e-4, 1e-2},
  };
  for (const auto& form : forms) {
    const std::string file = packed(source, form.options);
    const auto report = info_of(file);
    EXPECT_EQ(type_of(report, "tensors/displacement_surface"), form.surface) << form.options;
    EXPECT_EQ(type_of(report, "tensors/displacement_interior"), form.interior) << form.options;
    const auto& p = report["provenance"];
    const double stated = p["pack_error_worst"];
    EXPECT_GE(stated, form.least) << form.options;
    EXPECT_LE(stated, form.most) << form.options;
    EXPECT_LE(p["pack_error_rms"], stated);
    EXPECT_GE(p["stored_error"].get<double>(), stated);
    EXPECT_THAT(p["pack_history"].get<std::string>(), HasSubstr(p["packed_from_sha256"].get<std::string>()));

    palpate_bundle("verify " + file);
    const ProgramRun diff = palpate_bundle("diff --json " + source + " " + file, 3);
    for (const auto& section : nlohmann::json::parse(diff.out)["sections"])
      if (section["section"] == "displacements") {
        EXPECT_DOUBLE_EQ(section["worst_relative_error"], stated) << form.options;
        EXPECT_DOUBLE_EQ(section["largest_difference"], p["pack_error_entry"]) << form.options;
      }
    EXPECT_LE(std::filesystem::file_size(file), std::filesystem::file_size(source));
  }
}

TEST(PalpateBundlePack, WritesTheSameBytesTwice) {
  const std::string source = box_file();
  for (const std::string options : {"--precision f16", "--low-rank 1e-3 --precision f16"})
    EXPECT_EQ(file_bytes(packed(source, options, "a.h5")), file_bytes(packed(source, options, "b.h5"))) << options;
}

TEST(PalpateBundlePack, KeepsAHistoryAndAddsErrors) {
  const std::string once = packed(box_file(), "--precision f16", "once.h5");
  const std::string twice = packed(once, "--surface", "twice.h5");
  const auto first = info_of(once)["provenance"], second = info_of(twice)["provenance"];
  EXPECT_THAT(second["pack_history"].get<std::string>(),
              testing::StartsWith(first["pack_history"].get<std::string>() + "; "));
  EXPECT_EQ(second["pack_error_worst"], 0.0);
  EXPECT_EQ(second["stored_error"], first["stored_error"]);
  const std::string screen = palpate_bundle("info " + twice).out;
  EXPECT_LE(std::count(screen.begin(), screen.end(), '\n'), 40);
}

// As a bundle of many columns is written: palpate-precompute --low-rank leaves no rows to pack again.
TEST(PalpateBundlePack, RoundsBlocksToHalvesAsItPacksHalvesAtOnce) {
  const std::string source = box_file(), blocks = packed(source, "--low-rank 1e-3", "blocks.h5");
  const std::string halves = packed(blocks, "--precision f16", "halves.h5"),
                    at_once = packed(source, "--low-rank 1e-3 --precision f16", "at_once.h5");
  const auto report = info_of(halves), before = info_of(blocks)["provenance"], expected = info_of(at_once);
  EXPECT_EQ(type_of(report, "tensors/compliance/values"), "f16");
  EXPECT_EQ(type_of(report, "tensors/displacement_interior"), "f16");
  // The length of the provenance apart.
  EXPECT_NEAR(static_cast<double>(std::filesystem::file_size(halves)),
              static_cast<double>(std::filesystem::file_size(at_once)), 4096);
  const auto& p = report["provenance"];
  EXPECT_GE(p["pack_error_worst"], 1e-4);  // as of rows above
  const double stored = before["stored_error"], rounded = p["pack_error_worst"];
  EXPECT_DOUBLE_EQ(p["stored_error"], stored + (1 + stored) * rounded);
  // Against the solved columns, errors of the blocks and of rounding do not add up to more than when both are made at once.
  EXPECT_LE(p["stored_error"], 1.5 * expected["provenance"]["stored_error"].get<double>());
  palpate_bundle("verify " + halves);
}

TEST(PalpateBundlePack, RefusesWhatGainsNothing) {
  const std::string source = box_file(false);
  const std::string f16 = packed(source, "--precision f16", "f16.h5"),
                    blocks = packed(source, "--low-rank 1e-3", "blocks.h5"),
                    halves = packed(blocks, "--precision f16", "halves.h5");
  write_bytes(scratch("text"), std::string(5000, 'x'));
  const struct {
    std::string arguments, sentence;
  } cases[] = {
      {source, "nothing to do"},
      {source + " --precision f64", "would take more bytes"},
      {source + " --precision f32", "would change nothing"},
      {source + " --surface", "would change nothing"},
      {source + " --low-rank 0.5", "from 1e-6 to 0.1"},
      {source + " --low-rank nan", "expected a finite number"},
      {source + " --low-rank 1e-3 --precision f64", "more bytes"},
      {f16 + " --low-rank 1e-3", "made from"},
      {blocks + " --low-rank 1e-2", "blocks, of f32"},
      {blocks + " --low-rank 1e-2 --precision f16", "made from"},
      {halves + " --precision f16", "blocks, of f16"},
      {source + " --patch x1", "need --mesh"},
      {source + " --precision f16 --mesh a.msh", "only used with"},
      {source + " --precision f8", "f8"},
      {scratch("text").string() + " --precision f16", "tensor bundle"},
      {scratch("missing").string() + " --precision f16", "cannot be read"},
  };
  for (const auto& [arguments, sentence] : cases) EXPECT_THAT(refused(arguments), HasSubstr(sentence)) << arguments;
  const std::string before = file_bytes(source);
  palpate_bundle("pack " + source + " -o " + source + " --precision f16", 2);
  EXPECT_EQ(file_bytes(source), before);
}

TEST(PalpateBundlePack, KeepsTheColumnsOfAPatchAndVerifiesThemAgainstTheInputs) {
  write_inputs("[store]\ninterior = true\n");
  const std::string source = precompute();
  const std::string mesh = " --mesh " + scratch("msh").string();
  for (const std::string options : {"", " --surface", " --precision f16", " --low-rank 1e-3"}) {
    const std::string file = packed(source, "--patch x1" + mesh + options);
    const auto report = info_of(file);
    EXPECT_EQ(report["counts"]["touchable"], 16);  // the face x1 of 4 x 3 x 3 cells
    const ProgramRun ended = verify_with_inputs(file, 0);
    EXPECT_THAT(ended.out, HasSubstr("solved again")) << options;
  }
  // By a boundary file's [touchable]; the columns of both ways are the same.
  write_bytes(scratch("subset.toml"),
              "name = \"tip\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { patch = \"x0\" }\n"
              "[touchable]\nselect = { patch = \"x1\" }\n");
  const std::string by_file = packed(source, "--touchable " + scratch("subset.toml").string() + mesh, "file.h5");
  EXPECT_EQ(info_of(by_file)["counts"]["touchable"], 16);
  const auto diff = nlohmann::json::parse(
      palpate_bundle("diff --json " + packed(source, "--patch x1" + mesh, "patch.h5") + " " + by_file, 3).out);
  EXPECT_TRUE(diff["sections"].empty()) << diff;

  EXPECT_THAT(refused(source + " --patch x0" + mesh), HasSubstr("selects none"));
  EXPECT_THAT(refused(source + " --patch top" + mesh), HasSubstr("\"x0\", \"x1\""));
  auto other = box_mesh({4, 3, 3}, {60, 50, 41}, 0.1);
  write_mesh(scratch("other.msh"), other);
  EXPECT_THAT(refused(source + " --patch x1 --mesh " + scratch("other.msh").string()), HasSubstr("the mesh that"));
}

TEST(PalpateBundlePack, EndsWithOneSentenceOnDamagedBlocks) {
  const std::string file = packed(box_file(false), "--low-rank 1e-3");
  const auto report = info_of(file);
  std::string bytes = file_bytes(file);
  for (const auto& section : report["sections"])
    if (section["path"] == "tensors/compliance/blocks")
      bytes[section["offset"].get<std::size_t>() + 16] = 99;  // a rank
  write_bytes(scratch("damaged.h5"), bytes);
  const std::string damaged = scratch("damaged.h5").string();
  palpate_bundle("verify " + damaged, 3);
  palpate_bundle("info " + damaged);
  palpate_bundle("diff " + damaged + " " + file, 3);  // two stores of one form: number by number
  palpate_bundle("diff " + damaged + " " + box_file(false), 2);
  palpate_bundle("pack " + damaged + " --precision f16 -o " + scratch("x.h5").string(), 2);
}

// What palpate-accuracy choose writes for a bundle of that provenance.
std::string measured_file(const nlohmann::json& provenance, const std::string& storage) {
  nlohmann::json measured = {{"accuracy_storage", storage},       {"accuracy_reference", "20000 p2-p0"},
                             {"accuracy_force_error", 0.025},     {"accuracy_field_error", 0.01},
                             {"accuracy_machine", "a processor"}, {"accuracy_touch_us", 1.5}};
  for (const char* key : {"mesh_sha256", "boundary_sha256", "element"})
    measured[std::string("accuracy_") + key] = provenance.value(key, "");
  write_bytes(scratch("measured.json"), measured.dump());
  return scratch("measured.json").string();
}

TEST(PalpateBundlePack, CarriesWhatWasMeasuredOfThisForm) {
  const std::string source = box_file(false);
  const auto provenance = info_of(source)["provenance"];
  const std::string f16 = packed(source, "--precision f16 --accuracy " + measured_file(provenance, "f16"));
  EXPECT_EQ(info_of(f16)["certificate"]["accuracy_force_error"], 0.025);
  EXPECT_THAT(palpate_bundle("info " + f16).out, HasSubstr("force 2.5 %, field 1 %, against 20000 p2-p0"));
  // Nothing but the certificate differs from the source.
  const std::string f32 = packed(source, "--accuracy " + measured_file(provenance, "f32"), "f32.h5");
  EXPECT_EQ(info_of(f32)["provenance"]["pack_error_worst"], 0.0);
  EXPECT_EQ(info_of(f32)["certificate"]["accuracy_touch_us"], 1.5);
  // Another form has another accuracy.
  EXPECT_FALSE(info_of(packed(f32, "--precision f16", "again.h5"))["provenance"].contains("accuracy_force_error"));
}

TEST(PalpateBundlePack, RefusesWhatWasMeasuredOfAnotherBundle) {
  const std::string source = box_file(false);
  auto provenance = info_of(source)["provenance"];
  const auto refused_with = [&](const std::string& file, const std::string& options) {
    return refused(source + " " + options + " --accuracy " + file);
  };
  EXPECT_THAT(refused_with(measured_file(provenance, "f16"), "--low-rank 1e-3"), HasSubstr("\"low-rank 0.001\""));
  provenance["mesh_sha256"] = "another";
  EXPECT_THAT(refused_with(measured_file(provenance, "f16"), "--precision f16"), HasSubstr("mesh_sha256 \"another\""));
  write_bytes(scratch("measured.json"), R"({"solver": "none"})");
  EXPECT_THAT(refused_with(scratch("measured.json").string(), "--precision f16"), HasSubstr("\"solver\""));
  EXPECT_THAT(refused_with(scratch("none.json").string(), "--precision f16"), HasSubstr("found no file"));
}

}  // namespace
}  // namespace palpate
