// A run in one file: a scene whose paths hold the position of each tool at each touch step. Comment lines at its head hold
// checksums of the bundle, of the results and of the file. palpate-run plays it like any scene; --replay compares the
// results with the checksums.
//
//   # palpate-run record 1
//   # bundle BBBBBBBBBBBBBBBB             checksum of the bundle's index, which covers all sections
//   # output CCCCCCCCCCCCCCCC SSSSSSSSSSSSSSSS   of all contacts and tool states; of all shapes (zero without shapes)
//   # record RRRRRRRRRRRRRRRR             of the whole file without this line
//   name = "push" ...                     a scene (formats/scene_config.h), in metres
//
// Every checksum is an XXH64, in hexadecimal. Numbers have so many digits that reading gives the same doubles.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/checksum.h"
#include "programs/player/player.h"

namespace palpate {

// Checksums of the results: all bytes of the contacts, with flags and residuals, and of the displacements and positions of
// all shapes.
struct OutputHash {
  std::uint64_t contacts = 0, shapes = 0;
  bool operator==(const OutputHash&) const = default;
};

class OutputHasher {
 public:
  void add(const TouchRecord& touch) { contacts_.update(&touch.contacts, touch.contacts.used_bytes); }
  void add(const ShapeRecord& shape);
  OutputHash hash() const { return {contacts_.digest(), any_ ? shapes_.digest() : 0}; }

 private:
  formats::Xxh64 contacts_, shapes_;
  bool any_ = false;
};

// Writes the record of a played scene. Reads the whole bundle once, to compare it with its checksums.
// Errors: InputError (the folder), OperationError.
void write_record(const std::filesystem::path& record, const Player& player, const std::filesystem::path& bundle,
                  const OutputHash& output);

// The checksums of a record. The file itself is the scene.
struct Record {
  std::uint64_t bundle = 0;
  OutputHash output;
};

// Errors: InputError where the file is no record, is cut off or was changed.
Record read_record(const std::filesystem::path& record);

// Plays the record and compares the results with its checksums; returns a line for the user.
// bundles: one to play on; empty: the one that the record names.
// scene: must be the one that was recorded; empty: is not compared.
// Errors: InputError for another bundle or scene, VerificationError where the results differ.
std::string replay(const std::filesystem::path& record, const std::vector<std::string>& bundles,
                   const std::filesystem::path& scene);

}  // namespace palpate
