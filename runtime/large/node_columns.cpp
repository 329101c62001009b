#include "runtime/large/node_columns.h"

#include <algorithm>

namespace palpate {

bool NodeColumns::create(SceneMemory& memory, const HyperelasticEnergy* energy, const BodyMetric* metric,
                         std::int32_t most_nodes) {
  energy_ = energy, metric_ = metric;
  kept_ = most_nodes > 0 ? std::clamp(most_nodes, std::int32_t{kMostNodes}, kMostKept) : 0;
  entries_ = memory.array<Entry>(static_cast<std::size_t>(kept_));
  numbers_ = memory.array<float>(static_cast<std::size_t>(kept_) * 3 * energy->length());
  if (memory.failed()) return false;
  forget();
  return true;
}

void NodeColumns::keep(SceneMemory& memory) {
  memory.keep_array(entries_, static_cast<std::size_t>(kept_));
  memory.keep(calls_);
}

NodeColumns::Known NodeColumns::known() const {
  Known known;
  std::copy_n(entries_, kept_, known.entries);
  known.calls = calls_;
  return known;
}

void NodeColumns::know(const Known& of) {
  std::copy_n(of.entries, kept_, entries_);
  calls_ = of.calls;
  std::int32_t known[kMostKept];
  int count = 0;
  for (std::int32_t e = 0; e < kept_; ++e)
    if (entries_[e].place >= 0) known[count++] = e;
  solve(known, count);
}

void NodeColumns::forget() {
  std::fill_n(entries_, kept_, Entry{});
  calls_ = 0;
}

std::int32_t NodeColumns::entry_of(std::int32_t place) const {
  for (std::int32_t e = 0; e < kept_; ++e)
    if (entries_[e].place == place) return e;
  return -1;
}

std::int32_t NodeColumns::oldest() const {
  const auto is_older = [](const Entry& a, const Entry& b) { return a.used < b.used; };
  return static_cast<std::int32_t>(std::min_element(entries_, entries_ + kept_, is_older) - entries_);
}

std::int32_t NodeColumns::find(const std::int32_t* places, std::int32_t count) {
  std::int32_t other[kMostNodes];
  int others = 0;
  ++calls_;
  for (std::int32_t i = 0; i < count; ++i)
    if (const std::int32_t entry = entry_of(places[i]); entry >= 0) entries_[entry].used = calls_;
  for (std::int32_t i = 0; i < count; ++i) {
    if (places[i] >= energy_->rows() || entry_of(places[i]) >= 0) continue;
    const std::int32_t entry = oldest();
    entries_[entry] = {places[i], calls_};
    other[others++] = entry;
  }
  solve(other, others);
  return 3 * others;
}

void NodeColumns::solve(const std::int32_t* entries, int count) {
  constexpr int kAtOnce = BodyMetric::kMostVectors / 3;
  for (int first = 0; first < count; first += kAtOnce) {
    const int some = std::min(kAtOnce, count - first);
    float* columns[BodyMetric::kMostVectors];
    for (int v = 0; v < 3 * some; ++v) {
      const std::int32_t entry = entries[first + v / 3];
      float* const y = columns[v] = numbers(entry, v % 3);
      std::fill_n(y, energy_->length(), 0.0f);
      y[3 * static_cast<std::size_t>(entries_[entry].place) + static_cast<std::size_t>(v % 3)] = 1;
      energy_->clear_held(y);
    }
    metric_->solve(columns, 3 * some);
  }
}

}  // namespace palpate
