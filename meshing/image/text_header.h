// The fields of the text headers of INR, NRRD and MetaImage.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace palpate {

// Each function that returns a field's value throws InputError, with the file and the field, for a field that is missing,
// that is given twice (some programs take the first value and others the last) or that is not a number.
struct TextHeader {
  std::filesystem::path file;
  std::map<std::string, std::string> fields;  // keys in lower case
  std::map<std::string, std::string> notes;   // NRRD's "key:=value", which are no fields
  std::set<std::string> repeated;             // fields given twice; harmless where nobody asks for them
  std::size_t bytes = 0;                      // length of the header

  bool has(const std::string& name) const { return fields.contains(name); }
  const std::string& at(const std::string& name) const;
  std::string get(const std::string& name, const std::string& otherwise) const;
  double number(const std::string& name) const;
  double number(const std::string& name, double otherwise) const;
  std::vector<double> numbers(const std::string& name) const;
};

// Reads lines of the form "name SEPARATOR value" up to and with the first line for which is_last returns true; lines that
// begin with # are comments. Skips a byte order mark. end: what the last line is, for the refusal of a text without one.
TextHeader read_text_header(const std::filesystem::path& file, const std::string& text, char separator,
                            const std::function<bool(const std::string&)>& is_last, const char* end);

double header_number(const std::filesystem::path& file, const std::string& field, const std::string& text);

std::string trimmed(const std::string& text);
std::string lower_case(std::string text);
std::vector<std::string> words_of(const std::string& text);

}  // namespace palpate
