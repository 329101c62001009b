// A run in one file: a scene whose paths are the tools' positions at every touch, headed by what it was played on and what
// came out. palpate-run plays it like any scene, and --replay holds it to its hashes.
//
//   # palpate-run record 1
//   # bundle BBBBBBBBBBBBBBBB             the checksum of the bundle's index, which holds those of all its sections
//   # output CCCCCCCCCCCCCCCC SSSSSSSSSSSSSSSS   of all contacts and tool states; of all shapes (zero without any)
//   # record RRRRRRRRRRRRRRRR             of the whole file without this line
//   name = "push" ...                     a scene (formats/scene_config.h), in metres
//
// Every hash is an XXH64, in hexadecimal. Numbers are written so that they are read as the same doubles.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "formats/checksum.h"
#include "programs/player/player.h"

namespace palpate {

// Of all that the runtime gave: every byte of the contacts (their flags and residuals too), and of every shape's
// displacements and positions.
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

// Writes the record of a played scene. Reads the whole bundle once, to hold it to its checksums.
// Errors: InputError (the folder), OperationError.
void write_record(const std::filesystem::path& record, const Player& player, const std::filesystem::path& bundle,
                  const OutputHash& output);

// What a record says. The file itself is the scene.
struct Record {
  std::uint64_t bundle = 0;
  OutputHash output;
};

// Errors: InputError where the file is no record, is cut short or has another byte anywhere.
Record read_record(const std::filesystem::path& record);

// Plays the record and compares what comes out; returns the line that says so.
// bundle: empty: the one that the record names.
// scene: refused unless it is the one that was recorded; empty: not asked.
// Errors: InputError for another bundle or scene, VerificationError where other numbers come out.
std::string replay(const std::filesystem::path& record, const std::filesystem::path& bundle,
                   const std::filesystem::path& scene);

}  // namespace palpate
