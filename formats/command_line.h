// The command line of every offline program, parsed with CLI11. For mains alone: a file that adds options includes
// <CLI/CLI.hpp> itself, and no library pays for compiling it.
#pragma once

#include <functional>
#include <string>

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace palpate {

// Calls define, which adds the program's options to the app; parses; calls body. Adds --help, --version, --quiet and --strict.
// Refuses a number that is not finite in every option. Returns the exit code: 0 done; 1 OperationError, std::bad_alloc or
// any other exception; 2 InputError or bad usage; 3 VerificationError. A failure prints one sentence, "NAME: ...", to
// stderr. What it printed has arrived where the code is 0: stdout on a full device ends with 1.
int run_program(int argc, char** argv, const std::string& name, const std::string& description,
                const std::function<void(CLI::App&)>& define, const std::function<void()>& body);

// For a main that opens something before run_program, which calls this first: opens those of stdin, stdout and stderr that the
// caller has closed, so that no file of the program gets their place and its lines. Reading and writing them fails all the same.
void open_standard_streams();

struct MakeRule;
// Adds the option --make-rule TARGET FILE (make_rule.h).
void define_make_rule(CLI::App& app, MakeRule& rule);

// For an option's check(): a number above 0; a number of 0 or above.
CLI::Validator positive_number();
CLI::Validator non_negative_number();

}  // namespace palpate
