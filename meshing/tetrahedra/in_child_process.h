// Runs a mesher in a child process, because the meshers can crash, hang and keep global state. The child returns
// bytes.
#pragma once

#include <functional>
#include <string>

#include "formats/errors.h"

namespace palpate {

// The child has used up its time.
struct OutOfTime : OperationError {
  using OperationError::OperationError;
};

// Forks, runs work in the child and returns the bytes that work returned. The child prints nothing. what names the
// mesher in messages ("gmsh"). Errors: InputError and OperationError as thrown by work; OperationError when the child
// crashes or runs out of memory; OutOfTime when it still runs after time_limit seconds and is killed, or when it has used
// processor_limit seconds of processor time (0: no such limit), which other programs on the machine do not change.
std::string run_in_child(const std::string& what, double time_limit, const std::function<std::string()>& work,
                         double processor_limit = 0);

}  // namespace palpate
