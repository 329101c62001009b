// Runs other Palpate programs and waits for them; a log file holds what they print.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::accuracy {

// Errors: OperationError with the command's last line and the log's name if the exit code is not 0.
void run_command(const std::vector<std::string>& arguments, const std::filesystem::path& log);

// What the command prints on standard output. Errors: as above, without a log.
std::string output_of(const std::vector<std::string>& arguments);

}  // namespace palpate::accuracy
