#include "precompute/journal/fingerprint.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "formats/checksum.h"
#include "formats/program.h"

namespace palpate {
namespace {

constexpr const char* kProcessor = "processor";

// For example "Intel(R) Xeon(R) Gold 6140 CPU @ 2.30GHz, OpenBLAS SkylakeX". OpenBLAS chooses its kernels by the
// processor, and they round differently.
std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  std::string line, name = "unknown";
  while (std::getline(file, line))
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos) {
      name = line.substr(line.find(": ") + 2);
      break;
    }
  if (void* found = dlsym(RTLD_DEFAULT, "openblas_get_corename"))
    name += std::string(", OpenBLAS ") + reinterpret_cast<char* (*)()>(found)();
  return name;
}

std::string layout_text(const std::vector<SectionShape>& sections) {
  std::string text;
  for (const auto& section : sections)
    text += fmt::format("{}:{}:{} ", static_cast<std::uint32_t>(section.id),
                        static_cast<std::uint32_t>(section.type.value_or(formats::ElementType{})),
                        fmt::join(section.shape, "x"));
  return text;
}

std::string short_text(const nlohmann::json& value) {
  const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  return text.size() > 60 ? text.substr(0, 12) + "..." : text;
}

}  // namespace

Fingerprint fingerprint_of(nlohmann::json provenance, const std::vector<SectionShape>& sections,
                           std::span<const ColumnBatch> batches) {
  Fingerprint fingerprint = std::move(provenance);
  fingerprint["program_sha256"] = sha256_of_file("/proc/self/exe");
  fingerprint["layout"] = layout_text(sections);
  formats::Xxh64 checksum;
  for (const auto& batch : batches) {
    const std::uint64_t nodes = batch.nodes.size();
    checksum.update(&nodes, sizeof nodes);
    checksum.update(batch.nodes.data(), nodes * sizeof(std::int32_t));
  }
  fingerprint["column_batches"] = fmt::format("{} ({:016x})", batches.size(), checksum.digest());
  fingerprint[kProcessor] = processor();
  return fingerprint;
}

std::string difference(const Fingerprint& earlier, const Fingerprint& now) {
  for (const auto& [key, value] : now.items()) {
    if (key == kProcessor) continue;
    if (!earlier.contains(key)) return fmt::format("{} is new", key);
    if (earlier[key] != value) return fmt::format("{} was {}, is {}", key, short_text(earlier[key]), short_text(value));
  }
  for (const auto& [key, value] : earlier.items())
    if (!now.contains(key)) return fmt::format("{} was {}, is gone", key, short_text(value));
  return {};
}

}  // namespace palpate
