#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "precompute/bundle_tool/bundle_commands.h"
#include "precompute/bundle_tool/bundle_file.h"
#include "precompute/bundle_tool/column_errors.h"

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

// One object for each key whose value differs: {"key", "a", "b"}; null on a side that does not have the key.
nlohmann::json provenance_differences(const nlohmann::json& a, const nlohmann::json& b) {
  nlohmann::json differences = nlohmann::json::array();
  std::set<std::string> keys;
  for (const auto* side : {&a, &b})
    for (const auto& item : side->items()) keys.insert(item.key());
  for (const std::string& key : keys) {
    const nlohmann::json in_a = a.contains(key) ? a[key] : nlohmann::json();
    const nlohmann::json in_b = b.contains(key) ? b[key] : nlohmann::json();
    if (in_a != in_b) differences.push_back({{"key", key}, {"a", in_a}, {"b", in_b}});
  }
  return differences;
}

bool same_form(const SectionEntry& a, const SectionEntry& b) {
  return a.type == b.type && a.rank == b.rank && a.bytes == b.bytes && std::equal(a.shape, a.shape + kMaxRank, b.shape);
}

constexpr SectionId kDisplacements[] = {SectionId::displacement_surface, SectionId::displacement_interior,
                                        SectionId::displacement_scale,   SectionId::compliance_nodes,
                                        SectionId::compliance_clusters,  SectionId::compliance_blocks,
                                        SectionId::compliance_values,    SectionId::compliance_scale};

// Whether both bundles store the displacements in the same sections and types, so that they can be compared number by
// number.
bool same_store(const BundleFile& a, const BundleFile& b) {
  for (const SectionId id : kDisplacements) {
    const SectionEntry *in_a = a.find(id), *in_b = b.find(id);
    if (id == SectionId::displacement_interior && (!in_a || !in_b)) continue;  // "only in" one of them
    if ((in_a == nullptr) != (in_b == nullptr)) return false;
    if (in_a && (!same_form(*in_a, *in_b) || in_a->type == static_cast<std::uint32_t>(ElementType::f16))) return false;
  }
  return true;
}

// Compares displacements that are stored in different forms, by their columns, at the nodes that are touchable in both
// bundles.
nlohmann::json decoded_difference(const BundleFile& a, const BundleFile& b) {
  StoredColumns of_a(a), of_b(b);
  nlohmann::json result = {{"section", "displacements"}, {"form_a", of_a.form()}, {"form_b", of_b.form()}};
  const auto touchable_a = a.numbers<std::int32_t>(SectionId::touchable),
             touchable_b = b.numbers<std::int32_t>(SectionId::touchable);
  if (a.index().counts.nodes != b.index().counts.nodes || of_a.surface_nodes() != of_b.surface_nodes()) {
    result["columns"] = 0;
    return result;
  }
  ColumnErrors errors;
  ColumnRows rows_a, rows_b;
  for (std::size_t k = 0; k < touchable_b.size(); ++k) {
    const auto at = std::lower_bound(touchable_a.begin(), touchable_a.end(), touchable_b[k]);
    if (at == touchable_a.end() || *at != touchable_b[k]) continue;
    of_a.read(static_cast<std::size_t>(at - touchable_a.begin()), rows_a);
    of_b.read(k, rows_b);
    errors.add(rows_b, rows_a, touchable_b[k]);
  }
  errors.finish();
  if (of_a.form() == of_b.form() && errors.largest_entry == 0 && touchable_a == touchable_b &&
      of_a.has_interior() == of_b.has_interior())
    return {};
  result["columns"] = errors.columns;
  result["worst_relative_error"] = errors.worst;
  result["rms_relative_error"] = errors.rms;
  result["largest_difference"] = errors.largest_entry;
  return result;
}

// One object for each section that differs. Provenance that is JSON in both bundles is compared key by key, in another
// place.
nlohmann::json section_differences(const BundleFile& a, const BundleFile& b) {
  nlohmann::json differences = nlohmann::json::array();
  std::set<std::uint32_t> ids;
  for (const BundleFile* side : {&a, &b})
    for (const SectionEntry& entry : side->entries()) ids.insert(entry.id);
  if (a.provenance().is_object() && b.provenance().is_object())
    ids.erase(static_cast<std::uint32_t>(SectionId::provenance));
  if (!same_store(a, b)) {
    for (const SectionId id : kDisplacements) ids.erase(static_cast<std::uint32_t>(id));
    const nlohmann::json decoded = decoded_difference(a, b);
    if (!decoded.empty()) differences.push_back(decoded);
  }
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
    if (s.contains("form_a") && s["columns"] == 0)
      fmt::print("{}: {} against {}, of no node that both have\n", name, s["form_a"].get<std::string>(),
                 s["form_b"].get<std::string>());
    else if (s.contains("form_a"))
      fmt::print(
          "{}: {} against {}; {} columns differ by {:.3g} at worst and {:.3g} RMS, relative; {:.3g} in an entry\n",
          name, s["form_a"].get<std::string>(), s["form_b"].get<std::string>(), s["columns"].get<std::int64_t>(),
          s["worst_relative_error"].get<double>(), s["rms_relative_error"].get<double>(),
          s["largest_difference"].get<double>());
    else if (s.contains("only_in"))
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
