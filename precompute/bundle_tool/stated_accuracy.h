// The accuracy that palpate-accuracy measured for a setting (mesh, element, storage ...), which a bundle made with that
// setting carries in its provenance: the keys that begin with "accuracy_" (formats/BUNDLE.md).
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace palpate {

// stored: the form of the displacements, "f32", "f16" or "low-rank 0.001". Errors: InputError where the file is no flat
// JSON object of such keys, or was measured for another mesh, boundary, element or form.
nlohmann::json read_stated_accuracy(const std::filesystem::path& file, const nlohmann::json& provenance,
                                    const std::string& stored);

// Removes the keys that an earlier form of the bundle carried.
void drop_stated_accuracy(nlohmann::json& provenance);

}  // namespace palpate
