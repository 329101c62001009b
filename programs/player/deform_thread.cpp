#include "programs/player/deform_thread.h"
#include <palpate/palpate_complete.h>

#include <chrono>

namespace palpate {

DeformThread::DeformThread(palpate_scene* scene, std::size_t most_times) {
  times_.reserve(most_times);
  if (palpate_scene_deform(scene) >= 0) thread_ = std::thread([this, scene] { run(scene); });
}

void DeformThread::stop() {
  stops_ = true;
  if (thread_.joinable()) thread_.join();
}

void DeformThread::run(palpate_scene* scene) {
  using Clock = std::chrono::steady_clock;
  while (!stops_) {
    const auto begin = Clock::now();
    if (palpate_scene_deform(scene) == 0)
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    else if (times_.size() < times_.capacity())
      times_.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }
}

}  // namespace palpate
