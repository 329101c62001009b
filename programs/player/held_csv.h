// links.csv, grasps.csv and needles.csv of a played scene, in SI units. A number has as many digits as its double needs.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "programs/player/world_player.h"

namespace palpate {

// links.csv: one row per touch and stretch of a link, in the frame of its organ, or in the world where it is between organs. grasps.csv: one row per touch and tool that may grasp. needles.csv: one row per
// touch and tool with a needle. A scene without links, grasps or needles has no such file.
class HeldCsvFiles {
 public:
  // organs: those of the scene, whose names are a column where there are several. They must outlive this.
  HeldCsvFiles(const std::filesystem::path& folder, std::vector<const PlayedOrgan*> organs,
               std::vector<std::string> names = {});
  // The same of several organs, with the links between them.
  HeldCsvFiles(const std::filesystem::path& folder, const WorldPlayer& player);
  // Call it between the touch of that time and the next one.
  void write(double time);
  // Errors: OperationError (a full disk).
  void close();

 private:
  void add_links(double time, std::size_t organ, fmt::memory_buffer& rows) const;
  void open_links();
  void add_links_between_organs(double time, fmt::memory_buffer& rows) const;
  void add_grasps(double time, std::size_t organ, fmt::memory_buffer& rows) const;
  void add_needles(double time, std::size_t organ, fmt::memory_buffer& rows) const;
  std::string cell_of(std::size_t organ) const { return names_.empty() ? "" : names_[organ] + ','; }

  std::vector<const PlayedOrgan*> organs_;
  std::vector<std::string> names_;
  const WorldPlayer* world_ = nullptr;
  std::filesystem::path folder_;
  std::optional<std::ofstream> links_, grasps_, needles_;
};

// "open", "holds", "slips", "let go".
const char* word_of(palpate_grasp_condition condition);

}  // namespace palpate
