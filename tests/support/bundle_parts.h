// The sections of a bundle in memory, which tests change, compare and write.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "formats/bundle_reader.h"
#include "formats/bundle_writer.h"

namespace palpate::tests {

struct BundlePart {
  std::vector<std::uint64_t> shape;
  std::string bytes;
  std::optional<formats::ElementType> type = {};
};

// The section's element type for a C++ type. std::uint16_t stands for the bits of a half.
template <class Number>
constexpr formats::ElementType element_type_of() {
  using formats::ElementType;
  if constexpr (std::is_same_v<Number, double>) return ElementType::f64;
  if constexpr (std::is_same_v<Number, float>) return ElementType::f32;
  if constexpr (std::is_same_v<Number, std::uint16_t>) return ElementType::f16;
  if constexpr (std::is_same_v<Number, std::int32_t>) return ElementType::i32;
  return ElementType::u8;
}

struct BundleParts {
  std::string provenance = R"({"format": "palpate bundle", "version": 2})";
  std::map<formats::SectionId, BundlePart> sections;

  template <class Number>
  void set(formats::SectionId id, std::vector<std::uint64_t> shape, const std::vector<Number>& numbers) {
    BundlePart& part = sections[id];
    part.shape = std::move(shape);
    part.type = element_type_of<Number>();
    part.bytes.assign(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
  }
  void set_text(formats::SectionId id, const std::string& text) { sections[id] = {{text.size()}, text}; }

  template <class Number>
  std::vector<Number> get(formats::SectionId id) const {
    const std::string& bytes = sections.at(id).bytes;
    std::vector<Number> numbers(bytes.size() / sizeof(Number));
    std::memcpy(numbers.data(), bytes.data(), bytes.size());
    return numbers;
  }
};

void write_bundle(const std::filesystem::path& file, const BundleParts& parts);

}  // namespace palpate::tests
