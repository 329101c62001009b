// Bytes that are not a bundle, or a damaged or malicious one. Copies have the exact size of the bytes, so that a sanitizer
// reports a read behind the end (make -f Makefile.data test-sanitized).
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <random>

#include "formats/bundle_reader.h"
#include "formats/checksum.h"
#include "formats/element_layout.h"
#include "tests/support/box_corridor.h"

namespace palpate {
namespace {

using namespace formats;

std::string bytes_of(const tests::BundleParts& parts) {
  const auto file =
      std::filesystem::path(testing::TempDir()) / ("bundle_hostile." + std::to_string(::getpid()) + ".h5");
  write_bundle(file, parts);
  std::ifstream in(file, std::ios::binary);
  std::string read{std::istreambuf_iterator<char>(in), {}};
  in.close();
  std::filesystem::remove(file);
  return read;
}

std::string whole_bundle() {
  static const std::string bytes = bytes_of(tests::tiny_bundle({.cells = {2, 2, 2}}));
  return bytes;
}

// Its nodes inside are 56 .. 63.
std::string bundle_with_corridor() {
  static const std::string bytes = [] {
    const tests::DenseBody dense = tests::dense_box({});
    tests::BundleParts parts = tests::dense_bundle(dense);
    tests::add_corridor(parts, dense, {56, 58, 63});
    return bytes_of(parts);
  }();
  return bytes;
}

BundleStatus status_of(const std::string& head, std::uint64_t file_bytes, BundleError* error = nullptr) {
  const std::size_t count = std::min<std::size_t>(head.size(), kUserBlockBytes);
  const std::unique_ptr<char[]> exact(new char[count]);
  std::memcpy(exact.get(), head.data(), count);
  BundleIndex index;
  BundleError unused;
  const BundleStatus status = read_bundle_index(exact.get(), file_bytes, &index, error ? error : &unused);
  EXPECT_EQ(read_bundle_index(exact.get(), file_bytes, &index, nullptr), status);  // the error may be null
  return status;
}

// The index of a bundle, which a test changes; the checksum is then made to fit.
struct Forgery {
  BundleHeader header;
  std::vector<SectionEntry> entries;
  std::string head;

  explicit Forgery(const std::string& bundle = whole_bundle()) : head(bundle.substr(0, kUserBlockBytes)) {
    std::memcpy(&header, head.data(), sizeof header);
    entries.resize(header.section_count);
    std::memcpy(entries.data(), head.data() + sizeof header, entries.size() * sizeof(SectionEntry));
  }
  SectionEntry& entry(SectionId id) {
    for (auto& e : entries)
      if (e.id == static_cast<std::uint32_t>(id)) return e;
    throw std::logic_error("no such section");
  }
  std::string sealed() {
    std::string bytes(kUserBlockBytes, '\0');
    header.section_count = static_cast<std::uint32_t>(entries.size());
    std::memcpy(bytes.data() + sizeof header, entries.data(), entries.size() * sizeof(SectionEntry));
    header.index_checksum = 0;
    std::memcpy(bytes.data(), &header, sizeof header);
    header.index_checksum = xxh64(bytes.data(), sizeof header + entries.size() * sizeof(SectionEntry));
    std::memcpy(bytes.data(), &header, sizeof header);
    return bytes;
  }
  BundleStatus status() {
    BundleError error;
    const BundleStatus found = status_of(sealed(), header.file_bytes, &error);
    EXPECT_EQ(error.status, found);
    EXPECT_EQ(error.text[0] == '\0', found == BundleStatus::ok);
    return found;
  }
};

TEST(HostileBundle, AForgeryThatChangesNothingIsAccepted) {
  EXPECT_EQ(Forgery().status(), BundleStatus::ok);
}

TEST(HostileBundle, WithAByteAddedIsRefused) {
  const std::string whole = whole_bundle();
  EXPECT_EQ(status_of(whole, whole.size()), BundleStatus::ok);
  EXPECT_EQ(status_of(whole, whole.size() + 1), BundleStatus::truncated);
}

TEST(HostileBundle, SaysWhatWasFound) {
  BundleError error;
  EXPECT_EQ(status_of("", 0, &error), BundleStatus::truncated);
  EXPECT_EQ(status_of("PALP", 4, &error), BundleStatus::truncated);
  EXPECT_EQ(status_of("not", 3, &error), BundleStatus::magic);
  EXPECT_EQ(status_of(std::string(kUserBlockBytes, '\0'), 10000, &error), BundleStatus::magic);
  EXPECT_NE(std::string(error.text).find("not finished"), std::string::npos) << error.text;
  EXPECT_EQ(status_of("\x89HDF\r\n\x1a\n" + std::string(kUserBlockBytes, '\0'), 10000, &error), BundleStatus::magic);
  EXPECT_NE(std::string(error.text).find("HDF5"), std::string::npos) << error.text;
  Forgery newer;
  newer.header.layout_version = kNewestLayout + 1;
  EXPECT_EQ(newer.status(), BundleStatus::version);
  newer.header.layout_version = kLayoutVersion - 1;
  EXPECT_EQ(newer.status(), BundleStatus::version);
}

// Each of these has a fitting checksum, so that only the checks of the index can refuse it.
TEST(HostileBundle, WithHostileValuesAndARightChecksumIsRefused) {
  constexpr auto kSurface = SectionId::displacement_surface;
  const std::pair<const char*, std::function<void(Forgery&)>> forgeries[] = {
      {"offset + bytes overflows", [](Forgery& f) { f.entry(kSurface).offset = UINT64_MAX - 4095; }},
      {"offset at the end", [](Forgery& f) { f.entry(kSurface).offset = (f.header.file_bytes / 4096 + 1) * 4096; }},
      {"offset one page too far",
       [](Forgery& f) {
         auto& e = f.entry(kSurface);
         e.offset = (f.header.file_bytes - e.bytes) / 4096 * 4096 + 4096;
       }},
      {"offset in the index", [](Forgery& f) { f.entry(SectionId::nodes).offset = 0; }},
      {"offset misaligned by 64", [](Forgery& f) { f.entry(SectionId::young).offset += 64; }},
      {"bytes beyond the file", [](Forgery& f) { f.entry(kSurface).bytes = UINT64_MAX; }},
      {"no bytes", [](Forgery& f) { f.entry(kSurface).bytes = 0; }},
      {"bytes less than the shape", [](Forgery& f) { f.entry(kSurface).bytes -= 4; }},
      {"bytes more than the shape", [](Forgery& f) { f.entry(kSurface).bytes += 4; }},
      {"shape that wraps to the right product",
       [](Forgery& f) {
         auto& e = f.entry(kSurface);  // 2^62 * 4 * 4 = 2^66 wraps to 0
         e.shape[0] = std::uint64_t{1} << 62;
         e.shape[1] = 4;
       }},
      {"shape above 32-bit indices",
       [](Forgery& f) { f.entry(SectionId::provenance).shape[0] = std::uint64_t{1} << 40; }},
      {"shape of zero", [](Forgery& f) { f.entry(SectionId::touchable).shape[0] = 0; }},
      {"unused dimension not one", [](Forgery& f) { f.entry(SectionId::region).shape[3] = 2; }},
      {"nodes and fixed disagree",
       [](Forgery& f) {
         auto& e = f.entry(SectionId::fixed);
         --e.shape[0];
         e.bytes -= 3;
       }},
      {"columns and touchable disagree",
       [](Forgery& f) {
         auto& e = f.entry(SectionId::touchable);
         --e.shape[0];
         e.bytes -= 4;
       }},
      {"second dimension not 3",
       [](Forgery& f) { std::swap(f.entry(SectionId::nodes).shape[0], f.entry(SectionId::nodes).shape[1]); }},
      {"more surface nodes than nodes",
       [](Forgery& f) {
         auto& n = f.entry(SectionId::nodes);
         auto& x = f.entry(SectionId::fixed);
         n.shape[0] = x.shape[0] = 2;
         n.bytes = 48;
         x.bytes = 6;
       }},
      {"wrong type of the same size",
       [](Forgery& f) { f.entry(SectionId::tetrahedra).type = static_cast<std::uint32_t>(ElementType::f32); }},
      {"type unknown", [](Forgery& f) { f.entry(SectionId::tetrahedra).type = 77; }},
      {"rank too large", [](Forgery& f) { f.entry(SectionId::nodes).rank = 5; }},
      {"rank of 2^32 - 1", [](Forgery& f) { f.entry(SectionId::nodes).rank = UINT32_MAX; }},
      {"rank of zero", [](Forgery& f) { f.entry(SectionId::nodes).rank = 0; }},
      {"reserved word", [](Forgery& f) { f.entry(SectionId::nodes).reserved = 1; }},
      {"two sections share all bytes",
       [](Forgery& f) { f.entry(SectionId::poisson).offset = f.entry(SectionId::young).offset; }},
      {"two sections share one page",
       [](Forgery& f) { f.entry(SectionId::force).offset = f.entry(kSurface).offset + 4096; }},
      {"an id twice",
       [](Forgery& f) { f.entry(SectionId::poisson).id = static_cast<std::uint32_t>(SectionId::young); }},
      {"no sections", [](Forgery& f) { f.entries.clear(); }},
      {"reserved words of the header", [](Forgery& f) { f.header.reserved[1] = 1; }},
      {"user block of another size", [](Forgery& f) { f.header.user_block_bytes = 8192; }},
  };
  for (const auto& [what, forge] : forgeries) {
    Forgery forgery;
    forge(forgery);
    EXPECT_EQ(forgery.status(), BundleStatus::section) << what;
  }
}

TEST(HostileBundle, WithMoreSectionsThanFitIsRefusedBeforeTheyAreRead) {
  for (const std::uint32_t count : {kMaxSections + 1, std::uint32_t{1} << 31, UINT32_MAX}) {
    std::string head = whole_bundle().substr(0, kUserBlockBytes);
    std::memcpy(head.data() + offsetof(BundleHeader, section_count), &count, sizeof count);
    EXPECT_EQ(status_of(head, whole_bundle().size()), BundleStatus::section);
  }
}

TEST(HostileBundle, WithoutASectionThatMustBeThereIsRefused) {
  std::size_t count = 0;
  const SectionDescription* sections = section_descriptions(&count);
  for (std::size_t i = 0; i < count; ++i) {
    Forgery forgery;
    const auto removed = std::erase_if(
        forgery.entries, [&](const SectionEntry& e) { return e.id == static_cast<std::uint32_t>(sections[i].id); });
    // A bundle needs the displacements as rows or as blocks; this one has rows.
    const bool needed = sections[i].always || sections[i].id == SectionId::displacement_surface;
    EXPECT_EQ(removed, needed || sections[i].id == SectionId::displacement_interior);
    EXPECT_EQ(forgery.status(), needed ? BundleStatus::section : BundleStatus::ok) << sections[i].path;
  }
}

TEST(HostileBundle, WithASectionOfALaterVersionIsStillRead) {
  // Later versions may add optional sections: the reader skips unknown ids whose bytes are in bounds.
  Forgery forgery;
  SectionEntry later{};
  later.id = 5000;
  later.type = 99;
  later.rank = 17;
  later.bytes = 8;
  std::uint64_t end = 0;
  for (const auto& e : forgery.entries) end = std::max(end, e.offset + e.bytes);
  later.offset = (end + 4095) / 4096 * 4096;
  forgery.header.file_bytes = later.offset + later.bytes;
  forgery.entries.push_back(later);
  EXPECT_EQ(forgery.status(), BundleStatus::ok);
  forgery.entries.back().bytes = 9;
  EXPECT_EQ(forgery.status(), BundleStatus::section);
}

TEST(HostileBundle, WithAnIndexOutsideItsTargetIsRefused) {
  const std::string whole = whole_bundle();
  BundleIndex index;
  ASSERT_EQ(read_bundle_index(whole.data(), whole.size(), &index, nullptr), BundleStatus::ok);
  const auto status = [&](SectionId id, std::size_t element, std::int32_t value) {
    const SectionEntry* entry = find_section(index, id);
    const bool bytes = id == SectionId::fixed;
    std::vector<std::int32_t> numbers(bytes ? 0 : entry->bytes / 4);
    std::vector<std::uint8_t> flags(bytes ? entry->bytes : 0);
    std::memcpy(bytes ? static_cast<void*>(flags.data()) : numbers.data(), whole.data() + entry->offset, entry->bytes);
    if (bytes)
      flags[element] = static_cast<std::uint8_t>(value);
    else
      numbers[element] = value;
    IndexedSections sections;
    (id == SectionId::tetrahedra  ? sections.tetrahedra
     : id == SectionId::region    ? sections.region
     : id == SectionId::triangles ? sections.triangles
                                  : sections.touchable) = bytes ? nullptr : numbers.data();
    if (bytes) sections.fixed = flags.data();
    BundleError error;
    const BundleStatus found = check_stored_indices(index, sections, &error);
    if (found != BundleStatus::ok) {
      EXPECT_EQ(error.byte_offset, entry->offset + element * (bytes ? 1 : 4)) << error.text;
    }
    return found;
  };
  const auto nodes = static_cast<std::int32_t>(index.counts.nodes),
             surface = static_cast<std::int32_t>(index.counts.surface_nodes);
  EXPECT_EQ(status(SectionId::tetrahedra, 7, nodes - 1), BundleStatus::ok);
  EXPECT_EQ(status(SectionId::tetrahedra, 7, nodes), BundleStatus::content);
  EXPECT_EQ(status(SectionId::tetrahedra, 4 * index.counts.tetrahedra - 1, -1), BundleStatus::content);
  EXPECT_EQ(status(SectionId::region, 0, 1), BundleStatus::content);
  EXPECT_EQ(status(SectionId::region, 0, INT32_MIN), BundleStatus::content);
  EXPECT_EQ(status(SectionId::triangles, 3 * index.counts.triangles - 1, surface), BundleStatus::content);
  EXPECT_EQ(status(SectionId::touchable, index.counts.touchable - 1, surface), BundleStatus::content);
  EXPECT_EQ(status(SectionId::touchable, 1, 0), BundleStatus::content);  // not ascending
  EXPECT_EQ(status(SectionId::fixed, 3 * index.counts.nodes - 1, 2), BundleStatus::content);
}

TEST(HostileBundle, WithAPartOfACorridorIsRefused) {
  using Id = SectionId;
  EXPECT_EQ(Forgery(bundle_with_corridor()).status(), BundleStatus::ok);
  constexpr Id all[] = {Id::corridor_nodes, Id::corridor_compliance, Id::corridor_surface, Id::corridor_interior,
                        Id::corridor_residual};
  // Every choice of the five sections: whole are none, all, and all but the interior.
  for (unsigned kept = 0; kept < 32; ++kept) {
    Forgery forgery(bundle_with_corridor());
    std::erase_if(forgery.entries, [&](const SectionEntry& e) {
      for (unsigned i = 0; i < 5; ++i)
        if (e.id == static_cast<std::uint32_t>(all[i])) return (kept >> i & 1u) == 0;
      return false;
    });
    const bool whole = kept == 0 || kept == 0b11111 || kept == 0b10111;
    EXPECT_EQ(forgery.status(), whole ? BundleStatus::ok : BundleStatus::section) << kept;
  }
}

TEST(HostileBundle, WithACorridorOfAnotherShapeIsRefused) {
  using Id = SectionId;
  // Another number of nodes in one section, or in all of them more than there are inside or than are allowed.
  for (const Id id : {Id::corridor_nodes, Id::corridor_compliance, Id::corridor_surface, Id::corridor_interior,
                      Id::corridor_residual}) {
    Forgery forgery(bundle_with_corridor());
    SectionEntry& entry = forgery.entry(id);
    entry.bytes = entry.bytes / entry.shape[0] * 2, entry.shape[0] = 2;
    EXPECT_EQ(forgery.status(), BundleStatus::section) << static_cast<unsigned>(id);
  }
  for (const Id id : {Id::corridor_compliance, Id::corridor_surface, Id::corridor_interior}) {
    Forgery forgery(bundle_with_corridor());
    SectionEntry& entry = forgery.entry(id);
    entry.bytes = entry.bytes / entry.shape[2] * 2, entry.shape[2] = 2;
    EXPECT_EQ(forgery.status(), BundleStatus::section) << static_cast<unsigned>(id);
  }
  Forgery forgery(bundle_with_corridor());
  std::uint64_t end = forgery.header.file_bytes;
  const auto enlarge = [&](Id id, std::uint64_t numbers) {
    SectionEntry& entry = forgery.entry(id);
    entry.bytes = entry.bytes / entry.shape[0] * numbers, entry.shape[0] = numbers;
    if (id == Id::corridor_compliance) entry.bytes = entry.bytes / entry.shape[2] * numbers, entry.shape[2] = numbers;
    entry.offset = (end + 4095) / 4096 * 4096, end = entry.offset + entry.bytes;
  };
  for (const Id id : {Id::corridor_nodes, Id::corridor_compliance, Id::corridor_surface, Id::corridor_interior,
                      Id::corridor_residual})
    enlarge(id, 9);
  forgery.header.file_bytes = end;
  BundleError error;
  EXPECT_EQ(status_of(forgery.sealed(), end, &error), BundleStatus::section);
  EXPECT_NE(std::string(error.text).find("corridor nodes, found 9"), std::string::npos) << error.text;
}

// Of the corridor's bundle with the region of a cut: the corridor's nodes and two of the surface.
std::string bundle_with_cut() {
  static const std::string bytes = [] {
    const tests::DenseBody dense = tests::dense_box({});
    tests::BundleParts parts = tests::dense_bundle(dense);
    tests::add_corridor(parts, dense, {56, 58, 63});
    tests::add_cut(parts, dense, {40, 41, 56, 58, 63});
    return bytes_of(parts);
  }();
  return bytes;
}

TEST(HostileBundle, WithAPartOfACutsRegionOrAnotherShapeIsRefused) {
  using Id = SectionId;
  EXPECT_EQ(Forgery(bundle_with_cut()).status(), BundleStatus::ok);
  constexpr Id all[] = {Id::cut_nodes, Id::cut_compliance, Id::cut_residual, Id::cut_reserve};
  for (unsigned kept = 0; kept < 16; ++kept) {
    Forgery forgery(bundle_with_cut());
    std::erase_if(forgery.entries, [&](const SectionEntry& e) {
      for (unsigned i = 0; i < 4; ++i)
        if (e.id == static_cast<std::uint32_t>(all[i])) return (kept >> i & 1u) == 0;
      return false;
    });
    EXPECT_EQ(forgery.status(), kept == 0 || kept == 15 ? BundleStatus::ok : BundleStatus::section) << kept;
  }
  for (const Id id : all) {
    Forgery forgery(bundle_with_cut());
    SectionEntry& entry = forgery.entry(id);
    entry.bytes = entry.bytes / entry.shape[0] * 4, entry.shape[0] = 4;
    EXPECT_EQ(forgery.status(), BundleStatus::section) << static_cast<unsigned>(id);
  }
  // More nodes than the body has, and than are allowed: the limits come before any product.
  for (const std::uint64_t count : {std::uint64_t{65}, std::uint64_t{0x7fffffff}}) {
    Forgery forgery(bundle_with_cut());
    std::uint64_t end = forgery.header.file_bytes;
    for (const auto& [id, rows] : {std::pair{Id::cut_nodes, count}, {Id::cut_residual, count}}) {
      SectionEntry& entry = forgery.entry(id);
      entry.bytes = entry.bytes / entry.shape[0] * rows, entry.shape[0] = rows;
      entry.offset = (end + 4095) / 4096 * 4096, end = entry.offset + entry.bytes;
    }
    forgery.header.file_bytes = end;
    BundleError error;
    EXPECT_EQ(status_of(forgery.sealed(), end, &error), BundleStatus::section);
    EXPECT_NE(std::string(error.text).find("in the region of the cut"), std::string::npos) << error.text;
  }
}

TEST(HostileBundle, WithNodesOfACutThatDoNotAscendIsRefused) {
  const std::string whole = bundle_with_cut();
  BundleIndex index;
  ASSERT_EQ(read_bundle_index(whole.data(), whole.size(), &index, nullptr), BundleStatus::ok);
  EXPECT_EQ(index.counts.cut, 5u);
  const auto status = [&](const std::vector<std::int32_t>& nodes) {
    IndexedSections sections;
    sections.cut_nodes = nodes.data();
    return check_stored_indices(index, sections, nullptr);
  };
  EXPECT_EQ(status({0, 41, 56, 58, 63}), BundleStatus::ok) << "nodes of the surface are allowed";
  EXPECT_EQ(status({40, 41, 56, 58, 64}), BundleStatus::content);
  EXPECT_EQ(status({-1, 41, 56, 58, 63}), BundleStatus::content);
  EXPECT_EQ(status({41, 40, 56, 58, 63}), BundleStatus::content);
  EXPECT_EQ(status({40, 40, 56, 58, 63}), BundleStatus::content);
}

TEST(HostileBundle, WithCorridorNodesThatDoNotAscendInsideIsRefused) {
  const std::string whole = bundle_with_corridor();
  BundleIndex index;
  ASSERT_EQ(read_bundle_index(whole.data(), whole.size(), &index, nullptr), BundleStatus::ok);
  EXPECT_EQ(index.counts.corridor, 3u);
  const auto status = [&](const std::vector<std::int32_t>& nodes, std::size_t wrong) {
    IndexedSections sections;
    sections.corridor_nodes = nodes.data();
    BundleError error;
    const BundleStatus found = check_stored_indices(index, sections, &error);
    if (found != BundleStatus::ok) {
      EXPECT_EQ(error.byte_offset, find_section(index, SectionId::corridor_nodes)->offset + 4 * wrong) << error.text;
    }
    return found;
  };
  EXPECT_EQ(status({56, 58, 63}, 0), BundleStatus::ok);
  EXPECT_EQ(status({55, 58, 63}, 0), BundleStatus::content) << "a surface node";
  EXPECT_EQ(status({56, 58, 64}, 2), BundleStatus::content) << "beyond the nodes";
  EXPECT_EQ(status({56, -1, 63}, 1), BundleStatus::content);
  EXPECT_EQ(status({56, 63, 58}, 2), BundleStatus::content) << "not ascending";
  EXPECT_EQ(status({56, 56, 63}, 1), BundleStatus::content) << "twice";
}

}  // namespace
}  // namespace palpate
