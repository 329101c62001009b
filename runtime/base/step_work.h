// The work of a step, counted and limited. Counts do not depend on the machine or on its load, so a replay puts off the same work
// and gives the same bits.
#pragma once

#include <cstdint>

namespace palpate {

// What the work of a step is counted in: about a nanosecond of the 2.6 GHz server processor on which docs/speed.md was measured.
// One number that is read from a distant address counts 1, and kDense multiply-adds with numbers that lie side by side.
using Operations = std::int64_t;
inline constexpr Operations kDense = 6;
// More than a step can do, and so few that they can be multiplied: what counts as no limit.
inline constexpr Operations kUnlimitedOperations = 1'000'000'000'000'000;

// The work of queries. A query that has come to its limit ends, and its answer has no meaning.
class QueryWork {
 public:
  void limit(Operations most) { most_ = most < kUnlimitedOperations ? most : kUnlimitedOperations; }
  void add(Operations operations) { done_ += operations; }
  // Adds what fits. What does not fit is not to be done: the query ends.
  bool take(Operations operations) {
    ended_ = ended_ || operations > most_ - done_;
    if (!ended_) done_ += operations;
    return !ended_;
  }
  // Whether so many operations fit.
  bool fits(Operations operations) const { return !ended_ && operations <= most_ - done_; }
  void end() { ended_ = true; }
  bool ended() const { return ended_ || done_ > most_; }
  Operations left() const { return ended() ? 0 : most_ - done_; }
  Operations done() const { return done_; }

 private:
  Operations done_ = 0, most_ = kUnlimitedOperations;
  bool ended_ = false;
};

// A step counts no more than most(), whatever is asked of it. First it takes its input and looks at each tool point, which nothing puts
// off: create() is given more than that. Each other part of a step may take what its share and the parts before it leave. Of B, what is
// then left of most(), in the order of a step, and all together:
//     debts of the step before    up to B / 4
//     tests of points             up to B / 2
//     contacts that change        up to 3 B / 4; the first one of a step, where tests have taken more, up to what is kept
//     the solution                the rest. B / 8 is kept for it, or what its rows need at least (keep_for_solution()), at most 5 B / 8
// Where more than B / 8 is kept, debts, tests and changes have a third each of what is left, where that is less.
class StepWork {
 public:
  // Of one tool point or grip in a step that finds it far from the surface: it is checked, copied, taken into the organ's frame and compared
  // with the bounds on its way and the surface's. Where there are so many that they leave the caches (docs/speed.md).
  static constexpr Operations kOfPoint = 25;

  void create(Operations most) { limit_ = most_ = smaller(most, kUnlimitedOperations), kept_ = most_ / 8; }

  // points: tool points and grips of the step.
  void begin(Operations points = 0) {
    looked_ = points * kOfPoint, most_ = limit_ - looked_;
    done_ = smaller(owed_, most_ / 4 + most_ / 16), owed_ = 0, deferred_ = 0, kept_ = most_ / 8;
    paid_changes_ = owed_changes_, owed_changes_ = 0;
  }
  void forget() { owed_ = owed_changes_ = 0; }
  void add(Operations operations) { done_ += operations; }
  // Work that this step causes and the next one does. Work above the share for debts is dropped; only that of a body with a field of its own exceeds it.
  void owe(Operations operations) { owed_ += operations; }
  // The same of a contact that changes.
  void owe_change(Operations operations) { owe(operations), ++owed_changes_; }
  // Changes of contacts that are counted in done().
  Operations paid_changes() const { return paid_changes_; }
  void pay_change(Operations operations) { add(operations), ++paid_changes_; }
  // A job was put off.
  void defer() { ++deferred_; }
  std::int64_t deferred() const { return deferred_; }  // jobs of this step

  // least: that the solution takes at least. changes_left() and first_change_left() hold it within what a step has room for.
  void keep_for_solution(Operations least) { kept_ = larger(kept_, smaller(least, most_kept())); }

  Operations most() const { return limit_; }
  Operations done() const { return looked_ + done_; }
  Operations tests_left() const { return smaller(most_ / 2, before_solution() / 3 * 2) - done_; }
  // For a change after which the solution takes `least` at least. Below zero where no step has room for it.
  Operations changes_left(Operations least) const {
    return smaller(most_ - most_ / 4 - done_, first_change_left(least));
  }
  Operations first_change_left(Operations least) const {
    return least > most_kept() ? -1 : most_ - larger(kept_, least) - done_;
  }
  // What a test that comes first in a step has in every step.
  Operations tests_have() const { return smaller(most_ / 2, before_solution() / 3 * 2) - debts_end(); }
  Operations debts_left() const { return debts_end() - owed_; }
  // The first change of a step may owe a sixteenth more, so that each has its turn.
  Operations first_debt_left() const { return debts_end() + most_ / 16 - owed_; }
  // What is left of the step.
  Operations left() const { return done_ >= most_ ? 0 : most_ - done_; }

 private:
  static Operations smaller(Operations a, Operations b) { return a < b ? a : b; }
  static Operations larger(Operations a, Operations b) { return a < b ? b : a; }
  Operations most_kept() const { return most_ / 8 * 5; }
  Operations before_solution() const { return most_ - kept_; }
  Operations debts_end() const { return smaller(most_ / 4, before_solution() / 3); }

  Operations limit_ = 0, looked_ = 0, most_ = 0, kept_ = 0, done_ = 0, owed_ = 0, owed_changes_ = 0, paid_changes_ = 0;
  std::int64_t deferred_ = 0;
};

// Jobs that ask in ascending order of tool and point, in every step. Those that a step put off come first in the next one.
class Turns {
 public:
  void begin() { first_ = next_ == kNone ? 0 : next_, next_ = kNone, any_ = 0; }
  // Whether this job is done in this step. fits: the step's work allows it.
  bool take(std::int32_t tool, std::int32_t point, bool fits) {
    const std::int32_t key = key_of(tool, point);
    const bool turn = key >= first_;
    if (turn && fits) return (any_ = 1) != 0;
    if (turn && next_ == kNone) next_ = key;
    return false;
  }
  // Whether no job of this step was done before.
  bool is_first() const { return any_ == 0; }
  // The job that was taken last did not come to its end: it comes first in the next step. Not to be called where it was the first
  // one of this step: it had all that there is, and the others have their turn.
  void put_off(std::int32_t tool, std::int32_t point) {
    if (next_ == kNone) next_ = key_of(tool, point);
  }
  void forget() { first_ = 0, next_ = kNone; }

 private:
  static constexpr std::int32_t kNone = -1;  // keys are 0 and above
  static std::int32_t key_of(std::int32_t tool, std::int32_t point) {
    constexpr std::int32_t most_points = 100'000;  // of a tool (max_points)
    return tool * most_points + point;
  }
  std::int32_t first_ = 0;     // jobs with smaller keys wait for the next step
  std::int32_t next_ = kNone;  // the first job that did not fit
  std::int32_t any_ = 0;       // 1: a job of this step was done
};

}  // namespace palpate
