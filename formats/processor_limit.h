// A limit on the processor time of a whole program: no input takes longer, whatever the program is doing.
#pragma once

#include <string>

namespace palpate {

// Seconds of processor time of this program and of its child processes that have ended.
double processor_seconds();

// While it exists: when processor_seconds() reaches limit, prints "NAME: SENTENCE" as the program's last line on stderr and
// ends the program with exit code 1. The check takes place ten times per second of this program's own time; a child process
// needs a limit of its own (run_in_child). End it before output is written, so that nothing half-written is left. At most
// one exists at a time.
class ProcessorLimit {
 public:
  ProcessorLimit(std::string name, double limit, const std::string& sentence);
  ~ProcessorLimit();
  ProcessorLimit(const ProcessorLimit&) = delete;
  ProcessorLimit& operator=(const ProcessorLimit&) = delete;

  // Sets another limit and sentence.
  void change(double limit, const std::string& sentence);

 private:
  std::string name_;
};

}  // namespace palpate
