// The three ways in which an offline program fails. Libraries throw these; run_program (formats/command_line.h) turns them into
// one sentence on stderr and the exit code. The runtime library throws nothing and does not use this header.
#pragma once

#include <stdexcept>
#include <string>

namespace palpate {

// Exit code 1: an operation failed (I/O, memory, no convergence).
struct OperationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Exit code 2: bad input or usage. The sentence names the file, the line or key or byte, what was expected, what was
// found, and what to do.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Exit code 3: a verification did not hold.
struct VerificationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace palpate
