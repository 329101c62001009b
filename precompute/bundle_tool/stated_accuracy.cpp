#include "precompute/bundle_tool/stated_accuracy.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "formats/errors.h"

namespace palpate {
namespace {

bool is_stated(const std::string& key) {
  return key.rfind("accuracy_", 0) == 0;
}

}  // namespace

nlohmann::json read_stated_accuracy(const std::filesystem::path& file, const nlohmann::json& provenance,
                                    const std::string& stored) {
  std::ifstream in(file);
  if (!in)
    throw InputError(fmt::format("{}: expected what palpate-accuracy choose wrote, found no file", file.string()));
  const auto stated = nlohmann::json::parse(in, nullptr, false);
  if (!stated.is_object() || stated.empty())
    throw InputError(
        fmt::format("{}: expected what palpate-accuracy choose wrote, a JSON object, found none", file.string()));
  for (const auto& [key, value] : stated.items())
    if (!is_stated(key) || !value.is_primitive() || value.is_null())
      throw InputError(
          fmt::format("{}: \"{}\": expected keys accuracy_... with a text, a number or a boolean each; "
                      "let palpate-accuracy choose write the file",
                      file.string(), key));
  const auto check = [&](const char* key, const std::string& found) {
    const std::string expected = stated.value(key, "");
    if (expected != found)
      throw InputError(
          fmt::format("{}: was measured with {} \"{}\", this bundle has \"{}\"; bake and pack it as "
                      "palpate-accuracy choose says",
                      file.string(), key + 9, expected, found));
  };
  for (const char* key : {"mesh_sha256", "boundary_sha256", "element"})
    check(fmt::format("accuracy_{}", key).c_str(), provenance.value(key, ""));
  check("accuracy_storage", stored);
  return stated;
}

void drop_stated_accuracy(nlohmann::json& provenance) {
  for (auto it = provenance.begin(); it != provenance.end();)
    it = is_stated(it.key()) ? provenance.erase(it) : std::next(it);
}

}  // namespace palpate
