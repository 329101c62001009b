#include "tests/support/bundle_parts.h"

namespace palpate::tests {

void write_bundle(const std::filesystem::path& file, const BundleParts& parts) {
  std::vector<SectionShape> shapes;
  for (const auto& [id, part] : parts.sections) shapes.push_back({id, part.shape, part.type});
  const auto entries = lay_out_bundle(file, shapes, parts.provenance);
  {
    SectionWriter writer(file);
    for (const auto& entry : entries) {
      const auto part = parts.sections.find(static_cast<formats::SectionId>(entry.id));
      if (part != parts.sections.end()) writer.write(entry, 0, part->second.bytes.data(), part->second.bytes.size());
    }
  }
  seal_bundle(file, entries);
}

}  // namespace palpate::tests
