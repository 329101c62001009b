#include "meshing/image/label_names.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <vector>

#include "formats/byte_order_mark.h"
#include "meshing/image/file_bytes.h"

namespace palpate {
namespace {

using std::filesystem::path;
using Names = std::map<float, std::string>;
using Json = nlohmann::json;

constexpr std::size_t kMostBytes = std::size_t{1} << 20;  // of a header or of a file beside the image

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Without quotes and blanks at the ends, and without control characters, which could change a terminal.
std::string cleaned(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  const auto first = text.find_first_not_of(" \"'");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \"'") - first + 1);
}

std::optional<float> whole_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value != std::floor(value) || std::abs(value) > 1e7)
    return {};
  return static_cast<float>(value);
}

void add(Names& names, float label, const std::string& name) {
  const std::string text = cleaned(name);
  if (!text.empty()) names.emplace(label, text);
}

// ---- JSON ----------------------------------------------------------------------------------------------------------

// {"1": "spleen"} or {"spleen": 1}; nothing where one entry is neither, because then the numbers are not labels.
Names names_of_table(const Json& table) {
  Names names;
  for (const auto& [key, value] : table.items()) {
    const std::optional<float> label = whole_number(key);
    if (label && value.is_string())
      add(names, *label, value.get<std::string>());
    else if (!label && value.is_number_integer())
      add(names, value.get<float>(), key);
    else if (!value.is_array())  // an array names several labels at once
      return {};
  }
  return names;
}

// {"labelID": 1, "SegmentLabel": "spleen", ...}
Names name_of_object(const Json& object) {
  Names names;
  for (const char* number : {"labelID", "labelValue", "value", "label", "id", "index"})
    for (const char* text : {"name", "SegmentLabel", "label"})
      if (names.empty() && object.contains(number) && object[number].is_number_integer() && object.contains(text) &&
          object[text].is_string())
        add(names, object[number].get<float>(), object[text].get<std::string>());
  return names;
}

constexpr int kDeepest = 8;  // levels of tables and lists; a hostile file has as many as it has bytes

Names names_of_json(const Json& json, int depth) {
  Names names;
  if (json.is_object()) names = name_of_object(json);
  if (json.is_object() && names.empty()) names = names_of_table(json);
  if (!names.empty() || !json.is_structured() || depth == kDeepest) return names;
  for (const Json& child : json) names.merge(names_of_json(child, depth + 1));
  return names;
}

Names names_of_json(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  return json.is_discarded() ? Names{} : names_of_json(json, 0);
}

// ---- CSV -----------------------------------------------------------------------------------------------------------

// The first whole number and the first word of each line; a line without both, as a heading, is passed over.
Names names_of_csv(const std::string& text) {
  Names names;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == ';' || c == '\t'; }, ',');
    std::optional<float> label;
    std::string name;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) {
      cell = cleaned(cell);
      const std::optional<float> number = whole_number(cell);
      if (number && !label) label = number;
      if (!number && name.empty()) name = cell;
    }
    if (label) add(names, *label, name);
  }
  return names;
}

// ---- the image's own header ----------------------------------------------------------------------------------------

// <Label Key="1" ...><![CDATA[spleen]]></Label>
Names names_of_label_table(const std::string& xml) {
  Names names;
  for (std::size_t at = xml.find("<Label "); at != std::string::npos; at = xml.find("<Label ", at + 1)) {
    const std::size_t open = xml.find('>', at), close = xml.find("</Label>", at), key = xml.find("Key=\"", at);
    if (open == std::string::npos || close == std::string::npos || key == std::string::npos || key > open ||
        close < open)
      continue;
    const std::optional<float> label = whole_number(xml.substr(key + 5, xml.find('"', key + 5) - key - 5));
    std::string text = xml.substr(open + 1, close - open - 1);
    const std::size_t data = text.find("<![CDATA["), end = text.find("]]>");
    if (data != std::string::npos && end != std::string::npos && end > data)
      text = text.substr(data + 9, end - data - 9);
    if (label) add(names, *label, text);
  }
  return names;
}

Names names_of_nifti(const path& image) {
  const std::string head = read_head(image, kMostBytes);
  const auto int_at = [&](std::size_t offset) {
    std::uint32_t value = 0;
    std::memcpy(&value, head.data() + offset, sizeof value);
    std::uint32_t size = 0;
    std::memcpy(&size, head.data(), sizeof size);
    return size == 348 ? value : __builtin_bswap32(value);  // 348 bytes: the header in this machine's byte order
  };
  if (head.size() < 352 || head[348] == 0) return {};
  const std::uint32_t bits = int_at(108);  // vox_offset, where the voxels begin; 0 where they are in another file
  float voxels = 0;
  std::memcpy(&voxels, &bits, sizeof voxels);
  const std::size_t end =
      voxels >= 352 && voxels < static_cast<float>(head.size()) ? static_cast<std::size_t>(voxels) : head.size();
  for (std::size_t at = 352; at + 8 <= end;) {
    const std::size_t size = int_at(at);
    if (size < 16 || size > end - at) return {};
    const std::string text(head.data() + at + 8, strnlen(head.data() + at + 8, size - 8));
    Names names = names_of_label_table(text);
    if (names.empty()) names = names_of_json(text);
    if (!names.empty()) return names;
    at += size;
  }
  return {};
}

Names names_of_nrrd(const path& image) {
  const std::string head = read_head(image, kMostBytes);
  std::map<std::string, std::string> fields;  // Segment0_Name and the like
  std::istringstream lines(head);
  for (std::string line; std::getline(lines, line) && line.find_first_not_of("\r") != std::string::npos;)
    if (const auto at = line.find(":="); at != std::string::npos && line.starts_with("Segment"))
      fields.emplace(line.substr(0, at), cleaned(line.substr(at + 2)));
  Names names;
  for (const auto& [key, name] : fields) {
    if (!key.ends_with("_Name")) continue;
    const auto label = fields.find(key.substr(0, key.size() - 5) + "_LabelValue");
    if (label == fields.end()) continue;
    if (const std::optional<float> number = whole_number(label->second)) add(names, *number, name);
  }
  return names;
}

// ---- files beside the image ----------------------------------------------------------------------------------------

Names names_of_file(const path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error) || std::filesystem::file_size(file, error) > kMostBytes || error)
    return {};
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  text.erase(0, byte_order_mark(text));
  return file.extension() == ".json" ? names_of_json(text) : names_of_csv(text);
}

}  // namespace

std::map<float, std::string> read_label_names(const path& image) {
  const std::string name = lower(image.filename().string());
  Names names;
  if (name.ends_with(".nii") || name.ends_with(".nii.gz") || name.ends_with(".hdr")) names = names_of_nifti(image);
  if (name.ends_with(".nrrd") || name.ends_with(".nhdr")) names = names_of_nrrd(image);
  if (!names.empty() || std::filesystem::is_directory(image)) return names;

  path stem = image.filename();
  if (stem.extension() == ".gz") stem = stem.stem();
  const std::string own = stem.stem().string();
  for (const std::string& beside : {own + ".json", own + ".csv", own + ".tsv", std::string("labels.json"),
                                    std::string("labels.csv"), std::string("labels.tsv"), std::string("dataset.json")})
    if (names.empty()) names = names_of_file(image.parent_path() / beside);
  return names;
}

}  // namespace palpate
