// Other programs of the house, run to their end with all that they say in a log file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::accuracy {

// Errors: OperationError with the command's last line and the name of the log where it ends badly.
void run_command(const std::vector<std::string>& arguments, const std::filesystem::path& log);

// What the command prints on standard output. Errors: as above, without a log.
std::string output_of(const std::vector<std::string>& arguments);

}  // namespace palpate::accuracy
