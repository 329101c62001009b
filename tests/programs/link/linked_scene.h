// A probe that comes down on the tiny box, drags and leaves it, as a scene file beside its bundle.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "programs/link/contacts_datagram.h"
#include "programs/player/bundle_fields.h"
#include "tests/support/test_files.h"
#include "tests/support/tiny_bundle.h"
#include "tests/support/tools.h"

namespace palpate::tests {

namespace fs = std::filesystem;

inline const std::string kTwoTools =
    "[[tool]]\nname = \"probe\"\npoints = [[0, 0, 0], [3, 1, 0]]\n"
    "path = [[0, 41, 26, 44], [0.1, 41, 26, 35], [0.2, 44, 27, 36]]\n"
    "[[tool]]\nname = \"finger\"\npoints = [[0, 0, 0]]\npath = [[0, 25, 20, 42], [0.15, 25, 20, 37]]\n";

class LinkedScene : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fresh_folder();
    write_bundle(folder_ / "box.h5", tiny_bundle());
  }

  // Writes and reads NAME.toml.
  SceneConfig scene(const std::string& name = "scene", const std::string& head = "",
                    const std::string& tools = kTwoTools) {
    std::ofstream(folder_ / (name + ".toml")) << "name = \"" << name << "\"\nbundle = \"box.h5\"\nunit = \"mm\"\n"
                                              << head << tools;
    return read_scene_config(folder_ / (name + ".toml"));
  }
  fs::path bundle() const { return folder_ / "box.h5"; }

  fs::path folder_;
};

// Contacts of the scene, with their memory.
struct OwnContacts {
  explicit OwnContacts(const Player& player) : words(palpate_contacts_bytes(player.runtime_scene()) / 8 + 1) {}
  palpate_contacts* get() { return reinterpret_cast<palpate_contacts*>(words.data()); }
  std::size_t bytes() const { return words.size() * sizeof words[0]; }
  std::vector<std::uint64_t> words;
};

using Bytes = std::vector<unsigned char>;

inline Bytes encoded(const palpate_contacts& contacts, const DatagramNote& note) {
  Bytes bytes(kMostDatagramBytes);
  bytes.resize(encode_contacts(contacts, note, bytes.data()));
  return bytes;
}

// The scene's contacts step by step, as datagrams of one session.
inline std::vector<Bytes> datagrams_of(Player& player, std::uint64_t bundle, std::uint64_t session) {
  std::vector<Bytes> out;
  OwnContacts contacts(player);
  DatagramNote note;
  note.bundle = bundle;
  note.session = session;
  palpate_scene_reset(player.runtime_scene());
  const double rate = player.scene().touch_hz;
  for (std::uint64_t step = 0; step < player.touch_count(); ++step) {
    note.time = static_cast<double>(step) / rate;
    ++note.sequence;
    player.move_tools(note.time);
    std::copy(player.positions().begin(), player.positions().end(), note.positions.begin());
    player.touch(1 / rate, contacts.get(), contacts.bytes());
    out.push_back(encoded(*contacts.get(), note));
  }
  return out;
}

// The positions of the shape that a player draws of contacts.
inline std::vector<float> shape_of(Player& player, const palpate_contacts* contacts) {
  std::vector<float> positions(3 * static_cast<std::size_t>(player.shape_node_count()));
  palpate_shape_out out = shape_out(nullptr, positions.data(), player.shape_node_count());
  EXPECT_EQ(palpate_scene_shape(player.runtime_scene(), contacts, &out), 0u);
  EXPECT_EQ(out.node_count, player.shape_node_count());
  return positions;
}

}  // namespace palpate::tests
