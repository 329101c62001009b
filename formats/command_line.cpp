#include "formats/command_line.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <new>
#include <system_error>

#include "formats/errors.h"
#include "formats/make_rule.h"
#include "formats/program.h"

namespace palpate {

namespace {

const std::string kNotWritten = "standard output cannot be written";

enum ExitCode { kDone = 0, kOperation = 1, kInput = 2, kVerification = 3 };

// CLI11's own validator prints the largest double in its refusal.
CLI::Validator number_from(const char* type, const char* expected, bool zero) {
  return CLI::Validator(
      [expected, zero](const std::string& text) -> std::string {
        double number = 0;
        if (CLI::detail::lexical_cast(text, number) && (number > 0 || (zero && number == 0)) && std::isfinite(number))
          return {};
        return fmt::format("expected {}, found {}", expected, text);
      },
      type);
}

// CLI11's ranges accept NaN.
void refuse_numbers_that_are_not_finite(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& text : option->results()) {
      double number = 0;
      if (option->get_type_name().find("FLOAT") != std::string::npos && CLI::detail::lexical_cast(text, number) &&
          !std::isfinite(number))
        throw CLI::ValidationError(option->get_name(), fmt::format("expected a finite number, found {}", text));
    }
  for (const CLI::App* sub : app.get_subcommands()) refuse_numbers_that_are_not_finite(*sub);
}

// So that an exit code of 0 means that everything printed has arrived. std::cout, on which CLI11 prints, writes to stdout at once.
void flush_output() {
  const bool flushed = std::fflush(stdout) == 0;
  const std::string reason = flushed ? "" : fmt::format(": {}", std::strerror(errno));
  if (!flushed || std::ferror(stdout)) throw OperationError(kNotWritten + reason);
}

int fail(const std::string& name, const std::string& text, ExitCode code) {
  say_failure(name, text);
  return code;
}

}  // namespace

void open_standard_streams() {
  // The lowest free descriptor is the next that opens. It is opened the wrong way round, so that its use fails.
  for (const int wanted : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(wanted, F_GETFD) < 0)
      static_cast<void>(::open("/dev/null", wanted == STDIN_FILENO ? O_WRONLY : O_RDONLY));
}

CLI::Validator positive_number() {
  return number_from("POSITIVE", "a number above 0", false);
}
CLI::Validator non_negative_number() {
  return number_from("NONNEGATIVE", "a number of 0 or above", true);
}

void define_make_rule(CLI::App& app, MakeRule& rule) {
  app.add_option("--make-rule", rule.words,
                 "TARGET FILE: also write a rule for make to FILE, by which TARGET depends on all files that were read")
      ->expected(2)
      ->option_text("TARGET FILE");
}

int run_program(int argc, char** argv, const std::string& name, const std::string& description,
                const std::function<void(CLI::App&)>& define, const std::function<void()>& body) {
  open_standard_streams();
  try {
    CLI::App app(description, name);
    app.set_version_flag("--version", name + " " + PALPATE_VERSION);
    bool quiet = false, strict = false;
    app.add_flag("--quiet", quiet, "Errors and warnings only");
    app.add_flag("--strict", strict,
                 "End with exit code 3 where there was a warning; the output is written all the same");
    app.fallthrough();  // also after a subcommand
    set_quiet(false);
    forget_warnings();
    define(app);
    try {
      app.parse(argc, argv);
      refuse_numbers_that_are_not_finite(app);
    } catch (const CLI::Success& success) {  // --help, --version
      app.exit(success);
      flush_output();
      return kDone;
    } catch (const CLI::ParseError& error) {
      return fail(name, fmt::format("{}; see {} --help", error.what(), name), kInput);
    }
    set_quiet(quiet);
    body();
    flush_output();
    if (const std::size_t count = warnings().size(); strict && count > 0)
      return fail(name, fmt::format("--strict: expected no warning, found {}, printed above", count), kVerification);
    return kDone;
  } catch (const InputError& error) {
    return fail(name, error.what(), kInput);
  } catch (const VerificationError& error) {
    return fail(name, error.what(), kVerification);
  } catch (const std::system_error& error) {  // as fmt throws it where stdout takes no more
    return fail(name, std::ferror(stdout) ? kNotWritten + ": " + error.code().message() : error.what(), kOperation);
  } catch (const std::bad_alloc&) {
    return fail(name, "out of memory; use a smaller input or a larger machine", kOperation);
  } catch (const std::exception& error) {
    return fail(name, error.what(), kOperation);
  } catch (...) {
    return fail(name, "stopped by an error without a description", kOperation);
  }
}

}  // namespace palpate
