// forces.csv and contacts.csv of a played scene, in SI units. A number has as many digits as its double needs.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "programs/player/player.h"

namespace palpate {

// A tool's or a link's name as one cell: a comma or a quote in it must not shift the columns.
std::string quoted(const std::string& name);

// forces.csv: one row per touch and tool. contacts.csv: one row per touch and node under contact.
class CsvFiles {
 public:
  CsvFiles(const std::filesystem::path& folder, const SceneConfig& scene);
  void write(const TouchRecord& touch);
  // Errors: OperationError (a full disk).
  void close();

 private:
  const SceneConfig& scene_;
  std::filesystem::path folder_;
  std::ofstream forces_, contacts_;
};

}  // namespace palpate
