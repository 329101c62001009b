// links.csv, grasps.csv and needles.csv of a played scene, in SI units. A number has as many digits as its double needs.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "programs/player/csv_files.h"
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
  // As close_csv.
  void close() { close_csv(folder_, {&links_, &grasps_, &needles_}); }

 private:
  // Opens the file where it is not open; the heading begins with the time and, where there are several, the organ.
  void open(std::ofstream& file, const char* name, const char* heading);
  void open_links();
  void add_links(double time, std::size_t organ);
  void add_links_between_organs(double time);
  void add_grasps(double time, std::size_t organ);
  void add_needles(double time, std::size_t organ);
  std::string cell_of(std::size_t organ) const { return names_.empty() ? "" : names_[organ] + ','; }

  std::vector<const PlayedOrgan*> organs_;
  std::vector<std::string> names_;
  const WorldPlayer* world_ = nullptr;
  std::filesystem::path folder_;
  std::ofstream links_, grasps_, needles_;
};

// "open", "holds", "slips", "let go".
const char* word_of(palpate_grasp_condition condition);

}  // namespace palpate
