// links.csv, grasps.csv, needles.csv, loads.csv, obstacles.csv, blades.csv, cut.csv and events.csv of a played scene, in SI units. docs/outputs.md says what each column is.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "programs/player/csv_table.h"
#include "programs/player/world_player.h"

namespace palpate {

// links.csv: one row per touch and stretch of a link, in the frame of its organ, or in the world where it is between organs. grasps.csv: one row
// per touch and tool that may grasp. needles.csv: one row per touch and tool with a needle. loads.csv: one row
// per touch and load. obstacles.csv: one row per touch and obstacle, of several organs and those that it holds off. blades.csv: one row
// per touch and blade that feels the tissue. cut.csv: of an organ that is
// cut, one row for the first touch, for each touch that changed the cut, and for the last one. events.csv: one row per event of a cut. A scene without links,
// grasps, needles, loads, obstacles or the effect cut has no such file.
class HeldCsvFiles {
 public:
  // organs: those of the scene, whose names are a column where there are several. They must outlive this.
  HeldCsvFiles(const std::filesystem::path& folder, const CsvStyle& style, std::vector<const PlayedOrgan*> organs,
               std::vector<std::string> names = {});
  // The same of several organs, with the links between them.
  HeldCsvFiles(const std::filesystem::path& folder, const CsvStyle& style, const WorldPlayer& player);
  // Call it between the touch of that time and the next one.
  void write(double time);
  // Errors: OperationError (a full disk).
  void close();

 private:
  // Opens the file where it is not open; the heading begins with the time and, where there are several, the organ.
  void open(CsvTable& file, const char* name, const char* heading);
  void open_links();
  void add_link(double time, const std::string& organ, const std::string& name, int part,
                const palpate_link_state& link);
  void add_links(double time, std::size_t organ);
  void add_links_between_organs(double time);
  void add_grasps(double time, std::size_t organ);
  void add_needles(double time, std::size_t organ);
  void add_loads(double time, std::size_t organ);
  void add_obstacles(double time, std::size_t organ);
  void add_blades(double time, std::size_t organ);
  void add_cut(double time, std::size_t organ);
  void add_cut_row(double time, std::size_t organ);
  // A row that begins with the time and, where there are several organs, with their name.
  template <typename... Cells>
  void row(CsvTable& file, double time, const std::string& organ, const Cells&... cells) {
    if (names_.empty())
      file.row(time, cells...);
    else
      file.row(time, organ, cells...);
  }
  std::string name_of(std::size_t organ) const { return names_.empty() ? "" : names_[organ]; }

  std::vector<const PlayedOrgan*> organs_;
  std::vector<std::string> names_;
  const WorldPlayer* world_ = nullptr;
  std::filesystem::path folder_;
  CsvTable links_, grasps_, needles_, loads_, obstacles_, blades_, cut_, events_;
  std::vector<CutHistory> histories_;  // [organ]
  double time_ = 0;                    // s, of the last touch
};

// "open", "holds", "slips", "let go".
const char* word_of(palpate_grasp_condition condition);

}  // namespace palpate
