// Which files a program has read, as a rule for make: what was made from them is made anew when one of them changes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

// Adds a file to those that were read. Call it where a file names another one: make knows only the first one. Any thread may call it.
void has_read(const std::filesystem::path& file);

struct MakeRule {
  std::vector<std::string> words;  // what is made, and the file of the rule; empty: no rule is asked for
};
// Writes the rule, by which make takes a file that is no longer there for one that has changed. TARGET has no character that make reads
// itself; the files may. Call it after the output is written. Errors: OperationError.
void write_make_rule(const MakeRule& rule);

}  // namespace palpate
