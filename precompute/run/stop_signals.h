// Ctrl-C, SIGTERM and a lost terminal end a run at once, with a sentence, and then as the signal does.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace palpate {

// First in main: threads started later, MPI's too, leave SIGINT, SIGTERM and SIGHUP to StopSignals. Those that are
// ignored (nohup, a shell's background) stay so.
void block_stop_signals();

class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // What to do before the program ends: gets the signal's name; runs on a thread of its own while the program goes on.
  // Once the next call has returned, the former is not running and never will.
  void on_stop(std::function<void(const std::string& signal)> farewell);

 private:
  void watch();

  std::mutex mutex_;
  std::function<void(const std::string&)> farewell_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace palpate
