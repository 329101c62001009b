// A bundle that is open for reading. Its index is checked when it is opened; sections are read piece by piece. Does not
// use libhdf5, which damaged files can crash.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/bundle_reader.h"
#include "formats/errors.h"

namespace palpate {

// The index of a bundle does not hold; status says what is wrong.
struct BundleRefused : InputError {
  BundleRefused(const std::string& sentence, formats::BundleStatus why) : InputError(sentence), status(why) {}
  formats::BundleStatus status;
};

class BundleFile {
 public:
  // Errors: BundleRefused where the file cannot be read or its index does not hold.
  explicit BundleFile(std::filesystem::path file);
  BundleFile(const BundleFile&) = delete;
  BundleFile& operator=(const BundleFile&) = delete;
  ~BundleFile();

  const std::filesystem::path& path() const { return path_; }
  const formats::BundleIndex& index() const { return index_; }
  std::span<const formats::SectionEntry> entries() const { return {index_.entries, index_.header.section_count}; }
  const formats::SectionEntry* find(formats::SectionId id) const { return formats::find_section(index_, id); }

  // Bytes first .. first + count - 1 of a section. Errors: OperationError.
  void read(const formats::SectionEntry& entry, std::uint64_t first, void* bytes, std::uint64_t count) const;

  // A whole section; empty where the bundle does not have it. Number must be the element type of the section.
  template <class Number>
  std::vector<Number> numbers(formats::SectionId id) const {
    const formats::SectionEntry* entry = find(id);
    if (!entry) return {};
    std::vector<Number> values(entry->bytes / sizeof(Number));
    read(*entry, 0, values.data(), values.size() * sizeof(Number));
    return values;
  }
  std::string text(formats::SectionId id) const;

  int descriptor() const { return descriptor_; }  // of the file, to map parts of it

  // The provenance where it is a flat JSON object, else a JSON null: the bytes of the file are not trusted.
  nlohmann::json provenance() const;

  // The lines of the section material/names.
  std::vector<std::string> region_names() const;

  // XXH64 of the section's bytes as they are now.
  std::uint64_t checksum(const formats::SectionEntry& entry) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  formats::BundleIndex index_;
};

// "mesh/nodes", or "section 99" for one that this version does not know.
std::string section_name(const formats::SectionEntry& entry);
// "f64", ...; "type 9" for one that this version does not know.
std::string type_name(std::uint32_t type);
inline std::string type_name(formats::ElementType type) {
  return type_name(static_cast<std::uint32_t>(type));
}
// "(6, 3)".
std::string shape_text(const formats::SectionEntry& entry);
// The number of that key; nothing where the object, or what may be none, has no such number.
std::optional<double> number_of(const nlohmann::json& object, const char* key);
// Text of a file for a terminal: control characters, which could change the terminal, become '?'.
std::string printable(const std::string& text);
// The JSON as text; bytes that are not UTF-8 are replaced.
std::string json_text(const nlohmann::json& json);

}  // namespace palpate
