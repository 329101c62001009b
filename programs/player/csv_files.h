// forces.csv and contacts.csv of a played scene, in SI units; of a scene of several organs organs.csv and pairs.csv as well. A number has as many digits as its double needs.
#pragma once

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>

#include "programs/player/player.h"
#include "programs/player/world_player.h"

namespace palpate {

// A tool's or a link's name as one cell: a comma or a quote in it must not shift the columns.
std::string quoted(const std::string& name);

// Closes those that are open. folder: where they are. Errors: OperationError (a full disk).
void close_csv(const std::filesystem::path& folder, std::initializer_list<std::ofstream*> files);

// forces.csv: one row per touch and tool. contacts.csv: one row per touch and node under contact.
// Of several organs: forces.csv of all organs together; contacts.csv with a column for the organ, in whose frame its rows are; organs.csv: one
// row per touch and organ; pairs.csv: one row per touch and place where two organs press one another, which a scene whose organs pass through
// one another does not have.
class CsvFiles {
 public:
  CsvFiles(const std::filesystem::path& folder, const SceneConfig& scene);
  void write(const TouchRecord& touch);
  void write(const WorldTouchRecord& touch);  // of a scene of several organs
  // As close_csv.
  void close() { close_csv(folder_, {&forces_, &contacts_, &organs_, &pairs_}); }

 private:
  const SceneConfig& scene_;
  std::filesystem::path folder_;
  std::ofstream forces_, contacts_, organs_, pairs_;
};

}  // namespace palpate
