// The links between organs of a played scene, as the library takes them, and what they came to.
#pragma once

#include <palpate/palpate_complete.h>

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "programs/player/link_stretches.h"
#include "programs/player/played_organ.h"

namespace palpate {

class OrganLinks {
 public:
  // One piece of a link between two of its ends: a palpate_world_link.
  struct Stretch : LinkStretch {
    std::string organs;  // "liver+kidney": of its ends
  };

  // Finds the places on the surfaces as they were meshed. poses: [organ]. Errors: InputError, which names the line, for a place that is
  // farther from its organ than the organ is large.
  OrganLinks(const SceneConfig& scene, const std::vector<std::unique_ptr<PlayedOrgan>>& organs,
             const std::vector<palpate_pose>& poses);

  const std::vector<Stretch>& stretches() const { return stretches_; }
  const std::vector<palpate_world_link>& links() const { return links_; }  // [stretch]
  bool empty() const { return links_.empty(); }
  // Gives the world its links as they are at a time, s, if they are not those that it has. Allocates nothing.
  void hold(palpate_world* world, double time);

 private:
  void find(const SceneConfig::Link& link, std::size_t index, const std::vector<std::unique_ptr<PlayedOrgan>>& organs,
            const std::vector<palpate_pose>& poses);

  const SceneConfig& scene_;
  std::vector<Stretch> stretches_;
  std::vector<palpate_world_link> links_;
  bool are_given_ = false;
};

// The largest tensions, and what broke.
class OrganLinkSummary {
 public:
  // scene, links: must outlive this.
  OrganLinkSummary(const SceneConfig& scene, const OrganLinks& links, const palpate_world* world);
  // Call it between the touch of that time, s, and the next one.
  void add(double time);
  nlohmann::ordered_json json() const;     // one entry for each stretch
  std::vector<std::string> lines() const;  // one for each that was taut

 private:
  const SceneConfig& scene_;
  const OrganLinks& links_;
  const palpate_world* world_;
  std::vector<LinkPeak> peaks_;  // [stretch]
};

}  // namespace palpate
