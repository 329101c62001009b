// forces.csv and contacts.csv of a played scene, in SI units; of a scene of several organs organs.csv and pairs.csv as well.
// docs/outputs.md says what each column is.
#pragma once

#include <filesystem>

#include "programs/player/csv_table.h"
#include "programs/player/player.h"
#include "programs/player/world_player.h"

namespace palpate {

// forces.csv: one row per touch and tool. contacts.csv: one row per touch and node under contact.
// Of several organs: forces.csv of all organs together; contacts.csv with a column for the organ, in whose frame its rows are; organs.csv: one
// row per touch and organ; pairs.csv: one row per touch and place where two organs press one another, which a scene whose organs pass through
// one another does not have.
class CsvFiles {
 public:
  CsvFiles(const std::filesystem::path& folder, const SceneConfig& scene, const CsvStyle& style);
  void write(const TouchRecord& touch);
  void write(const WorldTouchRecord& touch);  // of a scene of several organs
  // Errors: OperationError (a full disk).
  void close();

 private:
  const SceneConfig& scene_;
  CsvTable forces_, contacts_, organs_, pairs_;
};

}  // namespace palpate
