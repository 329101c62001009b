// The work of a step, counted and limited. Counts do not depend on the machine or on its load, so a replay puts off the same work
// and gives the same bits.
#pragma once

#include <cstdint>

namespace palpate {

// What the work of a step is counted in: about a nanosecond of the 2.6 GHz server processor on which docs/speed.md was measured.
// One number that is read from a distant address counts 1, and kDense multiply-adds with numbers that lie side by side.
using Operations = std::int64_t;
inline constexpr Operations kDense = 6;

// The work of queries. A query that has come to its limit ends, and its answer has no meaning.
class QueryWork {
 public:
  void limit(Operations most) { most_ = most; }
  void add(Operations operations) { done_ += operations; }
  // Adds what fits. What does not fit is not to be done: the query ends.
  bool take(Operations operations) {
    ended_ = ended_ || operations > most_ - done_;
    if (!ended_) done_ += operations;
    return !ended_;
  }
  void end() { ended_ = true; }
  bool ended() const { return ended_ || done_ > most_; }
  Operations done() const { return done_; }

 private:
  Operations done_ = 0, most_ = INT64_MAX;
  bool ended_ = false;
};

class StepWork {
 public:
  // most: operations of a step after which work is put off.
  void create(Operations most) { most_ = most; }

  void begin() { done_ = owed_, owed_ = 0, deferred_ = 0; }
  void forget() { owed_ = 0; }
  void add(Operations operations) { done_ += operations; }
  // Work that this step causes and the next one does.
  void owe(Operations operations) { owed_ += operations; }
  // A job was put off.
  void defer() { ++deferred_; }
  std::int64_t deferred() const { return deferred_; }  // jobs of this step

  // Tests of points may take half of a step's operations, tests and the contacts that they change three quarters.
  bool allows_tests() const { return tests_left() > 0; }
  Operations tests_left() const { return most_ / 2 - done_; }
  bool allows_changes() const { return done_ < most_ - most_ / 4; }
  bool allows_debts() const { return owed_ < most_ / 4; }
  Operations done() const { return done_; }
  // At most 10^15, so that it can be multiplied.
  Operations left() const { return multipliable(done_ >= most_ ? 0 : most_ - done_); }
  // What the contact laws may take: what is left, but an eighth at least, where a first test has taken more than its share.
  Operations left_for_laws() const { return multipliable(most_ - done_ > most_ / 8 ? most_ - done_ : most_ / 8); }

 private:
  static Operations multipliable(Operations operations) {
    constexpr Operations most = 1'000'000'000'000'000;
    return operations < most ? operations : most;
  }
  Operations most_ = 0, done_ = 0, owed_ = 0;
  std::int64_t deferred_ = 0;
};

// Jobs that ask in ascending order of tool and point, in every step. Those that a step put off come first in the next one.
class Turns {
 public:
  void begin() { first_ = next_, next_ = 0, any_ = 0; }
  // Whether this job is done in this step. fits: the step's work allows it. The first job of a step is always done.
  bool take(std::int32_t tool, std::int32_t point, bool fits) {
    const std::int32_t key = key_of(tool, point);
    const bool turn = key >= first_;
    if (turn && (fits || any_ == 0)) return (any_ = 1) != 0;
    if (turn && next_ == 0) next_ = key;
    return false;
  }
  // Whether no job of this step was done before.
  bool is_first() const { return any_ == 0; }
  // The job that was taken last did not come to its end: it comes first in the next step.
  void put_off(std::int32_t tool, std::int32_t point) {
    if (next_ == 0) next_ = key_of(tool, point);
  }
  void forget() { first_ = next_ = 0; }

 private:
  static std::int32_t key_of(std::int32_t tool, std::int32_t point) {
    constexpr std::int32_t most_points = 100'000;  // of a tool (max_points)
    return tool * most_points + point;
  }
  std::int32_t first_ = 0;  // jobs with smaller keys wait for the next step
  std::int32_t next_ = 0;   // the first job that did not fit
  std::int32_t any_ = 0;    // 1: a job of this step was done
};

}  // namespace palpate
