// Runs other Palpate programs and waits for them; a log file holds what they print.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::accuracy {

// Errors: OperationError with the command's last line and the log's name if the exit code is not 0.
void run_command(const std::vector<std::string>& arguments, const std::filesystem::path& log);

// The command by which palpate-precompute in the folder bin makes a bundle of a mesh, without the measurement of locking; `more`: the rest,
// with "-o" and the bundle.
std::vector<std::string> precompute_command(const std::filesystem::path& bin, const std::filesystem::path& mesh,
                                            const std::filesystem::path& organ, const std::filesystem::path& boundary,
                                            const std::vector<std::string>& more);

// Runs studies/STUDY/report.py of the source folder on FOLDER/RESULT.json, which writes FOLDER/report.html; the log is in FOLDER/logs.
// Returns the page. Errors: as run_command.
std::filesystem::path write_report(const std::filesystem::path& python, const std::filesystem::path& source,
                                   const std::string& study, const std::filesystem::path& folder,
                                   const std::string& result);

// What the command prints on standard output. Errors: as above, without a log.
std::string output_of(const std::vector<std::string>& arguments);

}  // namespace palpate::accuracy
