// Third-party meshers crash, hang and keep global state: they run in a child process that hands back bytes.
#pragma once

#include <functional>
#include <string>

namespace palpate {

// Forks, runs work in the child and returns the bytes it returned. The child prints nothing. what: "gmsh", for the
// sentence. Errors: InputError and OperationError as thrown by work; OperationError when the child crashes, runs out of
// memory or is still running after time_limit seconds (it is then killed).
std::string run_in_child(const std::string& what, double time_limit, const std::function<std::string()>& work);

}  // namespace palpate
