#include "formats/make_rule.h"

#include <algorithm>
#include <mutex>

#include "formats/atomic_file.h"

namespace palpate {
namespace {

std::mutex read_mutex;
std::vector<std::string> read_files;

// What make reads before the rule. A name in a variable may hold every character but # and $; a file that is no longer there counts as
// changed, where a plain rule would end make.
constexpr const char* kHead =
    "palpate_escaped = $(subst ?,\\?,$(subst *,\\*,$(subst [,\\[,$(subst $() ,\\ ,$1))))\n"
    "palpate_read = $(if $(wildcard $(palpate_escaped)),$(subst ;,\\;,$(subst "
    ":,\\:,$(palpate_escaped))),palpate-missing)\n"
    ".PHONY: palpate-missing\n";

std::string as_value(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (c == '#') text += '\\';
    if (c == '$') text += '$';
    text += c;
  }
  return text;
}

}  // namespace

void has_read(const std::filesystem::path& file) {
  const std::lock_guard<std::mutex> lock(read_mutex);
  const std::string name = file.lexically_normal().string();
  if (std::find(read_files.begin(), read_files.end(), name) == read_files.end()) read_files.push_back(name);
}

void write_make_rule(const MakeRule& rule) {
  if (rule.words.empty()) return;
  const std::lock_guard<std::mutex> lock(read_mutex);
  std::string text = kHead;
  for (const std::string& name : read_files)
    text += "palpate_file := " + as_value(name) + "\n" + rule.words[0] + ": $(call palpate_read,$(palpate_file))\n";
  write_text_atomically(rule.words[1], text);
}

}  // namespace palpate
