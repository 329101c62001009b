// The third thread of a scene under large deformation beside the touch.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

#include <palpate/palpate.h>

namespace palpate {

// From its creation to its end it solves the scene's body under the newest contacts. Nothing runs where the scene is of another
// deformation.
class DeformThread {
 public:
  // most_times: of solves that times() keeps. The scene must outlive this.
  explicit DeformThread(palpate_scene* scene, std::size_t most_times = 0);
  ~DeformThread() { stop(); }
  void stop();
  // us, of each solve. After stop().
  const std::vector<double>& times() const { return times_; }

 private:
  void run(palpate_scene* scene);
  std::atomic<bool> stops_ = false;
  std::vector<double> times_;
  std::thread thread_;
};

}  // namespace palpate
