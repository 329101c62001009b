#include "studies/accuracy/command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "formats/errors.h"

namespace palpate::accuracy {
namespace {

// Quotes a word for the shell: '...', with ' as '\''.
std::string quoted(const std::vector<std::string>& arguments) {
  std::string line;
  for (const auto& argument : arguments) {
    line += line.empty() ? "'" : " '";
    for (const char c : argument) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += "'";
  }
  return line;
}

std::string last_line(const std::filesystem::path& log) {
  std::ifstream in(log);
  std::string last;
  for (std::string line; std::getline(in, line);)
    if (!line.empty()) last = line;
  return last;
}

void check_end(int status, const std::vector<std::string>& arguments, const std::string& said) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  const std::string how = WIFEXITED(status) ? fmt::format("ended with {}", WEXITSTATUS(status)) : "was stopped";
  throw OperationError(fmt::format("{} {}: {}", fmt::join(arguments, " "), how, said));
}

}  // namespace

void run_command(const std::vector<std::string>& arguments, const std::filesystem::path& log) {
  const int status = std::system((quoted(arguments) + " > " + quoted({log.string()}) + " 2>&1").c_str());
  check_end(status, arguments, fmt::format("{} (all of it: {})", last_line(log), log.string()));
}

std::vector<std::string> precompute_command(const std::filesystem::path& bin, const std::filesystem::path& mesh,
                                            const std::filesystem::path& organ, const std::filesystem::path& boundary,
                                            const std::vector<std::string>& more) {
  std::vector<std::string> command = {
      (bin / "palpate-precompute").string(), mesh.string(), "--organ", organ.string(), "--boundary", boundary.string()};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

std::filesystem::path write_report(const std::filesystem::path& python, const std::filesystem::path& source,
                                   const std::string& study, const std::filesystem::path& folder,
                                   const std::string& result) {
  const auto page = folder / "report.html";
  run_command({python.string(), (source / "studies" / study / "report.py").string(),
               (folder / (result + ".json")).string(), "-o", page.string()},
              folder / "logs" / "report.txt");
  return page;
}

std::string output_of(const std::vector<std::string>& arguments) {
  std::FILE* pipe = ::popen(quoted(arguments).c_str(), "r");
  if (!pipe) throw OperationError(fmt::format("{}: cannot be started", arguments[0]));
  std::string out;
  char buffer[4096];
  for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) out.append(buffer, n);
  check_end(::pclose(pipe), arguments, "see above");
  return out;
}

}  // namespace palpate::accuracy
