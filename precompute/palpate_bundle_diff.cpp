#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "precompute/palpate_bundle_commands.h"
#include "precompute/palpate_bundle_file.h"

namespace palpate {

using namespace formats;

namespace {

struct NumberDifference {
  std::uint64_t differing = 0;  // elements
  double largest = 0;           // |a - b|; infinite where one is not finite
  double scale = 0;             // largest finite |a| or |b|
  double relative() const { return scale > 0 ? largest / scale : largest; }
};

template <class Number>
void compare_numbers(const char* a, const char* b, std::uint64_t bytes, NumberDifference& found) {
  for (std::uint64_t at = 0; at + sizeof(Number) <= bytes; at += sizeof(Number)) {
    Number x, y;
    std::memcpy(&x, a + at, sizeof x);
    std::memcpy(&y, b + at, sizeof y);
    const double p = static_cast<double>(x), q = static_cast<double>(y);
    if (std::isfinite(p)) found.scale = std::max(found.scale, std::abs(p));
    if (std::isfinite(q)) found.scale = std::max(found.scale, std::abs(q));
    if (std::memcmp(&x, &y, sizeof x) == 0) continue;
    ++found.differing;
    const double difference = std::abs(p - q);
    found.largest = std::isfinite(difference) ? std::max(found.largest, difference) : INFINITY;
  }
}

NumberDifference compare_section(const BundleFile& a, const BundleFile& b, const SectionEntry& in_a,
                                 const SectionEntry& in_b) {
  NumberDifference found;
  std::vector<char> of_a(1 << 20), of_b(1 << 20);
  for (std::uint64_t done = 0; done < in_a.bytes;) {
    const std::uint64_t count = std::min<std::uint64_t>(of_a.size(), in_a.bytes - done);
    a.read(in_a, done, of_a.data(), count);
    b.read(in_b, done, of_b.data(), count);
    switch (static_cast<ElementType>(in_a.type)) {
      case ElementType::f64:
        compare_numbers<double>(of_a.data(), of_b.data(), count, found);
        break;
      case ElementType::f32:
        compare_numbers<float>(of_a.data(), of_b.data(), count, found);
        break;
      case ElementType::i32:
        compare_numbers<std::int32_t>(of_a.data(), of_b.data(), count, found);
        break;
      default:
        compare_numbers<std::uint8_t>(of_a.data(), of_b.data(), count, found);
    }
    done += count;
  }
  return found;
}

// One object per key whose value differs: {"key", "a", "b"}; a side that lacks it has null.
nlohmann::json provenance_differences(const nlohmann::json& a, const nlohmann::json& b) {
  nlohmann::json differences = nlohmann::json::array();
  std::set<std::string> keys;
  for (const auto* side : {&a, &b})
    if (side->is_object())
      for (const auto& item : side->items()) keys.insert(item.key());
  for (const std::string& key : keys) {
    const nlohmann::json in_a = a.is_object() && a.contains(key) ? a[key] : nlohmann::json();
    const nlohmann::json in_b = b.is_object() && b.contains(key) ? b[key] : nlohmann::json();
    if (in_a != in_b) differences.push_back({{"key", key}, {"a", in_a}, {"b", in_b}});
  }
  return differences;
}

bool same_form(const SectionEntry& a, const SectionEntry& b) {
  return a.type == b.type && a.rank == b.rank && a.bytes == b.bytes && std::equal(a.shape, a.shape + kMaxRank, b.shape);
}

// One object per section that differs. Provenance that is JSON on both sides is compared key by key, not here.
nlohmann::json section_differences(const BundleFile& a, const BundleFile& b) {
  nlohmann::json differences = nlohmann::json::array();
  std::set<std::uint32_t> ids;
  for (const BundleFile* side : {&a, &b})
    for (std::uint32_t i = 0; i < side->index().header.section_count; ++i) ids.insert(side->index().entries[i].id);
  if (a.provenance().is_object() && b.provenance().is_object())
    ids.erase(static_cast<std::uint32_t>(SectionId::provenance));
  for (const std::uint32_t id : ids) {
    const SectionEntry* in_a = a.find(static_cast<SectionId>(id));
    const SectionEntry* in_b = b.find(static_cast<SectionId>(id));
    const std::string name = section_name(in_a ? *in_a : *in_b);
    if (!in_a || !in_b) {
      differences.push_back({{"section", name}, {"only_in", in_a ? "a" : "b"}});
    } else if (!same_form(*in_a, *in_b)) {
      differences.push_back({{"section", name},
                             {"a", type_name(in_a->type) + " " + shape_text(*in_a)},
                             {"b", type_name(in_b->type) + " " + shape_text(*in_b)}});
    } else if (const NumberDifference found = compare_section(a, b, *in_a, *in_b); found.differing == 0) {
      continue;
    } else if (in_a->type == static_cast<std::uint32_t>(ElementType::text)) {
      differences.push_back({{"section", name}, {"differing", found.differing}, {"elements", in_a->bytes}});
    } else {
      const std::uint64_t size = std::max<std::uint64_t>(1, element_bytes(static_cast<ElementType>(in_a->type)));
      differences.push_back({{"section", name},
                             {"elements", in_a->bytes / size},
                             {"differing", found.differing},
                             {"largest_difference", found.largest},
                             {"relative_difference", found.relative()}});
    }
  }
  return differences;
}

void print_report(const nlohmann::json& report) {
  for (const auto& p : report["provenance"])
    fmt::print("provenance {}: {} against {}\n", printable(p["key"].get<std::string>()), printable(json_text(p["a"])),
               printable(json_text(p["b"])));
  for (const auto& s : report["sections"]) {
    const auto name = s["section"].get<std::string>();
    if (s.contains("only_in"))
      fmt::print("{}: only in {}\n", name, s["only_in"].get<std::string>());
    else if (s.contains("a"))
      fmt::print("{}: {} against {}\n", name, s["a"].get<std::string>(), s["b"].get<std::string>());
    else if (!s.contains("largest_difference"))
      fmt::print("{}: {} of {} characters differ\n", name, s["differing"].get<std::uint64_t>(),
                 s["elements"].get<std::uint64_t>());
    else
      fmt::print("{}: {} of {} elements differ, by {:.3g} at most ({:.3g} of the section's largest)\n", name,
                 s["differing"].get<std::uint64_t>(), s["elements"].get<std::uint64_t>(),
                 s["largest_difference"].get<double>(), s["relative_difference"].get<double>());
  }
  if (report["equal"].get<bool>()) fmt::print("the bundles hold the same\n");
}

}  // namespace

void compare_bundles(const std::filesystem::path& path_a, const std::filesystem::path& path_b, bool json) {
  const BundleFile a(path_a), b(path_b);
  nlohmann::json report = {{"a", path_a.string()},
                           {"b", path_b.string()},
                           {"provenance", provenance_differences(a.provenance(), b.provenance())},
                           {"sections", section_differences(a, b)}};
  const bool equal = report["provenance"].empty() && report["sections"].empty();
  report["equal"] = equal;
  if (json)
    fmt::print("{}\n", json_text(report));
  else
    print_report(report);
  if (!equal)
    throw VerificationError(fmt::format("{} and {} differ in {} provenance keys and {} sections", path_a.string(),
                                        path_b.string(), report["provenance"].size(), report["sections"].size()));
}

}  // namespace palpate
