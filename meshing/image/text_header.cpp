#include "meshing/image/text_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "formats/byte_order_mark.h"
#include "formats/errors.h"

namespace palpate {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> all;
  for (std::string word; in >> word;) all.push_back(word);
  return all;
}

double header_number(const std::filesystem::path& file, const std::string& field, const std::string& text) {
  const std::string digits = text.starts_with('+') ? text.substr(1) : text;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) {
    throw InputError(fmt::format("{}: header field '{}': expected a number, found '{}'; correct the header",
                                 file.string(), field, text));
  }
  return value;
}

const std::string& TextHeader::at(const std::string& name) const {
  const auto found = fields.find(name);
  if (found == fields.end()) {
    throw InputError(fmt::format("{}: the header has no field '{}'; the file is not what its name says, or damaged",
                                 file.string(), name));
  }
  if (repeated.contains(name)) {
    throw InputError(fmt::format("{}: header field '{}' is given twice; remove one", file.string(), name));
  }
  return found->second;
}

std::string TextHeader::get(const std::string& name, const std::string& otherwise) const {
  return has(name) ? at(name) : otherwise;
}

double TextHeader::number(const std::string& name) const {
  return header_number(file, name, at(name));
}

double TextHeader::number(const std::string& name, double otherwise) const {
  return has(name) ? number(name) : otherwise;
}

std::vector<double> TextHeader::numbers(const std::string& name) const {
  std::vector<double> values;
  for (const std::string& word : words_of(at(name))) values.push_back(header_number(file, name, word));
  return values;
}

TextHeader read_text_header(const std::filesystem::path& file, const std::string& text, char separator,
                            const std::function<bool(const std::string&)>& is_last, const char* end) {
  TextHeader header;
  header.file = file;
  for (std::size_t start = byte_order_mark(text); start < text.size();) {
    const std::size_t line_end = text.find('\n', start);
    if (line_end == std::string::npos) break;
    const std::string line = text.substr(start, line_end - start);
    start = line_end + 1;
    const auto at = line.find(separator);
    if (at != std::string::npos && !line.starts_with('#')) {
      if (separator == ':' && line.compare(at, 2, ":=") == 0) {
        header.notes.emplace(line.substr(0, at), trimmed(line.substr(at + 2)));
      } else {
        const std::string name = lower_case(trimmed(line.substr(0, at)));
        if (!header.fields.emplace(name, trimmed(line.substr(at + 1))).second) header.repeated.insert(name);
      }
    }
    if (is_last(line)) {
      header.bytes = start;
      return header;
    }
  }
  throw InputError(
      fmt::format("{}: expected a header that ends with {}, found none in its first {} bytes; the file is cut "
                  "off or not what its name says",
                  file.string(), end, text.size()));
}

}  // namespace palpate
