// links.csv and grasps.csv of a played scene, in SI units. A number has as many digits as its double needs.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>

#include "programs/player/player.h"

namespace palpate {

// links.csv: one row per touch and stretch of a link. grasps.csv: one row per touch and tool that may grasp. A scene without links, or
// without grasps, has no such file.
class HeldCsvFiles {
 public:
  // player must outlive this.
  HeldCsvFiles(const std::filesystem::path& folder, const Player& player);
  // Call it between the touch and the next one.
  void write(const TouchRecord& touch);
  // Errors: OperationError (a full disk).
  void close();

 private:
  const Player& player_;
  std::filesystem::path folder_;
  std::optional<std::ofstream> links_, grasps_;
};

// "slack", "taut", "broken"; "open", "holds", "slips", "let go".
const char* word_of(palpate_link_condition condition);
const char* word_of(palpate_grasp_condition condition);

}  // namespace palpate
