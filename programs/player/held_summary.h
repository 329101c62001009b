// What the links, grasps, needles, loads, obstacles and cuts of a played scene came to.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "programs/player/needle_peak.h"
#include "programs/player/played_organ.h"

namespace palpate {

class HeldSummary {
 public:
  // organ must outlive this.
  explicit HeldSummary(const PlayedOrgan& organ);
  // Call it between the touch of that time, s, and the next one.
  void add(double time);
  // For summary.json: one entry for each stretch of a link, each load and each obstacle; of a tool with a grasp, a needle or a force one entry, else null.
  nlohmann::ordered_json links() const;
  nlohmann::ordered_json loads() const;
  nlohmann::ordered_json obstacles() const;
  nlohmann::ordered_json blades() const;  // an entry for each that feels the tissue
  nlohmann::ordered_json cut() const;     // null where the scene does not cut
  nlohmann::ordered_json grasp(std::size_t tool) const;
  nlohmann::ordered_json needle(std::size_t tool) const;
  nlohmann::ordered_json given_force(std::size_t tool) const;
  // One line for each stretch that was taut, for each grasp, needle, load and obstacle, and for the cut.
  std::vector<std::string> lines() const;
  // A sentence for each grasp that let go, each pair of jaws that are not on one fold, each needle that was stuck, and for a cut that did not begin or
  // could not go on.
  std::vector<std::string> warnings() const;

 private:
  struct Grasp {
    double peak_force = 0, peak_torque = 0, peak_torque_time = 0, slipped = 0;
    std::optional<double> let_go;  // s
  };
  struct Load {
    double area = 0, peak_force = 0, farthest = 0, farthest_time = 0;  // m^2, N, m, s
  };
  struct Obstacle {
    double peak_force = 0, peak_time = 0, peak_torque = 0, deepest = 0;  // N, s, N m, m
    int most_nodes = 0;
  };
  struct Blade {
    double peak_force = 0, peak_time = 0, peak_torque = 0;  // N, s, N m
    // J, J, m^2: since it came; each time before
    double work = 0, friction_work = 0, area = 0, work_of_earlier = 0, friction_work_of_earlier = 0,
           area_of_earlier = 0;
  };
  struct GivenForce {
    double farthest = 0, farthest_time = 0;  // m, s, from where the scene sends the tool
    int touches = 0, carried = 0;            // in contact; with the whole force
  };
  void add_grasp(std::size_t tool, double time);
  void add_given_force(std::size_t tool, double time);
  void add_load(std::size_t i, double time);
  void add_obstacle(std::size_t i, double time);
  void add_blade(std::size_t i, double time);
  std::optional<double> first_time_of(const char* event) const;
  const PlayedOrgan& organ_;
  std::vector<LinkPeak> links_;           // [stretch]
  std::vector<Grasp> grasps_;             // [tool]
  std::vector<NeedlePeak> needles_;       // [tool]
  std::vector<GivenForce> given_forces_;  // [tool]
  std::vector<Load> loads_;
  std::vector<Obstacle> obstacles_;
  std::vector<Blade> blades_;
  CutHistory cut_;
};

}  // namespace palpate
