// A program of ours as a child process, its output in files.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/programs/link/linked_scene.h"

namespace palpate::tests {

class Process {
 public:
  Process(std::vector<std::string> arguments, const fs::path& out, const fs::path& errors)
      : out_(out), errors_(errors) {
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 1, out.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&files, 2, errors.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
    std::vector<char*> words;
    for (auto& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    EXPECT_EQ(posix_spawn(&id_, words[0], &files, nullptr, words.data(), environ), 0);
    posix_spawn_file_actions_destroy(&files);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (id_ > 0) ::kill(id_, SIGKILL), wait();
  }
  int wait() {
    int status = 0;
    ::waitpid(id_, &status, 0);
    id_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 100 + WTERMSIG(status);
  }
  bool runs() {
    siginfo_t ended = {};
    return ::waitid(P_PID, static_cast<id_t>(id_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid == 0;
  }
  void stop() { ::kill(id_, SIGTERM); }
  std::string output() const { return file_bytes(out_); }
  std::string errors() const { return file_bytes(errors_); }

  // The address that the program prints once it listens.
  std::string address() {
    const std::string words = "listening on ";
    for (int tries = 0; tries < 3000 && runs(); ++tries) {
      const std::string text = output();
      if (const auto end = text.find('\n'); end != std::string::npos && text.rfind(words, 0) == 0)
        return text.substr(words.size(), end - words.size());
      ::usleep(10000);
    }
    ADD_FAILURE() << "it does not listen: " << errors();
    return "127.0.0.1:9";
  }

 private:
  pid_t id_ = -1;
  fs::path out_, errors_;
};

}  // namespace palpate::tests
