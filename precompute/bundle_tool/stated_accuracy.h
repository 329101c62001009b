// What palpate-accuracy measured of a setting, as it travels in the provenance of a bundle baked in that setting: keys that
// begin with "accuracy_" (formats/BUNDLE.md).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace palpate {

// Errors: InputError when the file is no flat JSON object of such keys, or is not about a bundle of that provenance whose
// displacements are stored in that form ("f32", "f16", "low-rank 0.001").
nlohmann::json read_stated_accuracy(const std::filesystem::path& file, const nlohmann::json& provenance,
                                    const std::string& stored);

// Leaves out what an earlier form of the bundle stated.
void drop_stated_accuracy(nlohmann::json& provenance);

}  // namespace palpate
