// Ctrl-C (SIGINT), SIGTERM and a closed terminal (SIGHUP) end a run at once: it says in a sentence what is kept, and
// then ends by that signal, so that a shell or make sees it.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace palpate {

// Must be called first in main, so that all threads that start later, those of MPI too, leave the three signals to
// StopSignals. A signal that is ignored (by nohup, or in a shell's background) stays ignored.
void block_stop_signals();

class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // farewell is called with the name of the signal before the program ends, on another thread, while the program goes
  // on. When a call of on_stop has returned, the farewell of the call before is not running and never will.
  void on_stop(std::function<void(const std::string& signal)> farewell);

 private:
  void watch();

  std::mutex mutex_;
  std::function<void(const std::string&)> farewell_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace palpate
