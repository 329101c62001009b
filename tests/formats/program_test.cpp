#include "formats/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iterator>
#include <new>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using tests::file_bytes;
using tests::fresh_folder;

struct Ended {
  int code;
  std::string out, err;
};

Ended run(std::vector<std::string> words, const std::function<void()>& body) {
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  int number = 0;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const int code = run_program(
      static_cast<int>(arguments.size()), arguments.data(), "palpate-test", "A test",
      [&](CLI::App& app) { app.add_option("--number", number, "A number"); }, body);
  const std::string out = testing::internal::GetCapturedStdout(), err = testing::internal::GetCapturedStderr();
  return {code, out, err};
}

TEST(Program, EndsWithTheCodeOfItsError) {
  EXPECT_EQ(run({"x"}, [] {}).code, 0);
  EXPECT_EQ(run({"x"}, [] { throw OperationError("a"); }).code, 1);
  EXPECT_EQ(run({"x"}, [] { throw std::bad_alloc(); }).code, 1);
  EXPECT_EQ(run({"x"}, [] { throw std::runtime_error("a"); }).code, 1);
  EXPECT_EQ(run({"x"}, [] { throw 3; }).code, 1);
  EXPECT_EQ(run({"x"}, [] { throw InputError("a"); }).code, 2);
  EXPECT_EQ(run({"x"}, [] { throw VerificationError("a"); }).code, 3);
}

TEST(Program, SaysOneLineWhateverTheErrorHolds) {
  const Ended ended = run({"x"}, [] { throw InputError("a.msh: line 3:\nexpected\n"); });
  EXPECT_EQ(ended.err, "palpate-test: a.msh: line 3: expected\n");
  EXPECT_EQ(ended.out, "");
}

TEST(Program, RefusesUnknownOptionsAndBadValuesWithoutRunning) {
  bool ran = false;
  const auto body = [&] { ran = true; };
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"x", "--nmber", "3"}, {"x", "--number", "three"}}) {
    const Ended ended = run(words, body);
    EXPECT_EQ(ended.code, 2);
    EXPECT_THAT(ended.err, StartsWith("palpate-test: "));
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1);
  }
  EXPECT_FALSE(ran);
}

TEST(Program, AnswersHelpAndVersionOnStdout) {
  const Ended help = run({"x", "--help"}, [] { FAIL(); });
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.out, HasSubstr("--number"));
  const Ended version = run({"x", "--version"}, [] { FAIL(); });
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.out, std::string("palpate-test ") + PALPATE_VERSION + "\n");
}

TEST(Program, EndsWithThreeWhereStrictFindsAWarning) {
  const auto warns = [] { warn("the organ is 104 m long"); };
  EXPECT_EQ(run({"x"}, warns).code, 0);
  const Ended strict = run({"x", "--strict"}, warns);
  EXPECT_EQ(strict.code, 3);
  EXPECT_EQ(strict.err,
            "warning: the organ is 104 m long\npalpate-test: --strict: expected no warning, found 1, printed above\n");
  EXPECT_EQ(run({"x", "--strict"}, [] {}).code, 0);  // the warnings of an earlier run in this process are forgotten
  EXPECT_EQ(run({"x", "--strict"}, [] { warn("a"), throw InputError("b"); }).code, 2);
}

TEST(Program, ReportsAShortJobInOneLineAwayFromATerminal) {
  testing::internal::CaptureStderr();
  {
    Progress progress("solve", 1000);
    for (int i = 0; i < 1000; ++i) progress.advance();
  }
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::MatchesRegex("solve: 100 % \\(1000 of 1000\\), took . s\n"));
}

// ---- streams that take nothing -----------------------------------------------------------------------------------------

// Runs the program in a process of its own with this stream on the device; nullptr: closed, as by 2>&- of a shell.
Ended run_with(int stream, const char* device, std::vector<std::string> words, const std::function<void()>& body) {
  const auto errors = fresh_folder() / "errors.txt";
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open(errors.c_str(), O_CREAT | O_WRONLY, 0600), STDERR_FILENO);
    ::close(stream);
    if (device) ::open(device, O_WRONLY);  // gets the lowest free descriptor: stream
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    ::_exit(run_program(
        static_cast<int>(arguments.size()), arguments.data(), "palpate-test", "A test", [](CLI::App&) {}, body));
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), "", file_bytes(errors)};
}

TEST(Program, WritesItsResultWhereStandardErrorTakesNothing) {
  for (const char* device : {"/dev/full", static_cast<const char*>(nullptr)}) {
    const auto file = fresh_folder() / "result.txt";
    const Ended ended = run_with(STDERR_FILENO, device, {"x"}, [&] {
      std::ofstream result(file);  // gets the descriptor of a stream that is closed
      result << "one\n" << std::flush;
      warn("a");
      note("b");
      {
        Progress progress("c", 2);
        progress.advance(2);
      }
      result << "two\n";
    });
    EXPECT_EQ(ended.code, 0) << (device ? device : "closed");
    EXPECT_EQ(file_bytes(file), "one\ntwo\n") << (device ? device : "closed");
  }
}

TEST(Program, EndsWithOneWhereStandardOutputDoesNotTakeWhatItPrints) {
  for (const char* device : {"/dev/full", static_cast<const char*>(nullptr)}) {
    for (const std::size_t bytes : {10u, 1'000'000u}) {  // less and more than a buffer
      const Ended ended = run_with(STDOUT_FILENO, device, {"x"}, [&] { fmt::print("{}\n", std::string(bytes, 'a')); });
      EXPECT_EQ(ended.code, 1) << (device ? device : "closed");
      EXPECT_THAT(ended.err, StartsWith("palpate-test: standard output cannot be written")) << bytes;
    }
    for (const char* option : {"--help", "--version"}) {
      const Ended ended = run_with(STDOUT_FILENO, device, {"x", option}, [] {});
      EXPECT_EQ(ended.code, 1) << option;
      EXPECT_THAT(ended.err, StartsWith("palpate-test: standard output cannot be written")) << option;
    }
    EXPECT_EQ(run_with(STDOUT_FILENO, device, {"x"}, [] {}).code, 0) << "nothing printed, nothing lost";
  }
}

TEST(Program, HashesAFileAsSha256sumDoes) {
  const auto file = fresh_folder() / "abc";
  write_text_atomically(file, "abc");  // the vector of FIPS 180-2, appendix B.1
  EXPECT_EQ(sha256_of_file(file.string()), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_THROW(sha256_of_file((file.parent_path() / "missing").string()), InputError);
  EXPECT_THROW(sha256_of_file(file.parent_path().string()), InputError);
}

TEST(AtomicFile, IsAbsentUntilCommittedAndLeavesNothingBehind) {
  const auto folder = fresh_folder();
  const auto target = folder / "a.txt";
  {
    AtomicFile file(target);
    std::ofstream(file.part()) << "half";
    EXPECT_TRUE(std::filesystem::exists(file.part()));
    EXPECT_FALSE(std::filesystem::exists(target));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  {
    AtomicFile file(target);
    std::ofstream(file.part()) << "whole";
    file.commit();
  }
  EXPECT_EQ(file_bytes(target), "whole");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt.part"));
}

TEST(AtomicFile, KeepsTheOldFileWhenTheNewOneFails) {
  const auto target = fresh_folder() / "a.txt";
  write_text_atomically(target, "old");
  try {
    AtomicFile file(target);
    std::ofstream(file.part()) << "new";
    throw OperationError("the disk is full");
  } catch (const OperationError&) {
  }
  EXPECT_EQ(file_bytes(target), "old");
}

TEST(AtomicFile, NamesAFolderThatIsNotThere) {
  const auto folder = fresh_folder();
  EXPECT_THAT(tests::input_error([&] { AtomicFile file(folder / "no" / "a.txt"); }), HasSubstr("does not exist"));
  EXPECT_THROW(AtomicFile(folder.string()), InputError);  // a folder cannot be the file
}

TEST(AtomicFile, FailsAsAnOperationWhenThePartWasNeverWritten) {
  AtomicFile file(fresh_folder() / "a.txt");
  EXPECT_THROW(file.commit(), OperationError);
}

}  // namespace
}  // namespace palpate
