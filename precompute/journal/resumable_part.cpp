#include "precompute/journal/resumable_part.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"

namespace palpate {
namespace {

using formats::SectionEntry;
using formats::SectionId;

std::filesystem::path beside(std::filesystem::path target, const char* ending) {
  target += ending;
  return target;
}

bool holds_displacements(const SectionEntry& entry) {
  return entry.id == static_cast<std::uint32_t>(SectionId::displacement_surface) ||
         entry.id == static_cast<std::uint32_t>(SectionId::displacement_interior);
}

// Copies everything outside the displacement sections.
void copy_all_but_displacements(const std::filesystem::path& from_path, const std::filesystem::path& to_path,
                                std::vector<SectionEntry> entries) {
  const PlainFile from(from_path, O_RDONLY), to(to_path, O_RDWR);
  const std::uint64_t end = from.size();
  to.resize(end);
  to.reserve();
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.offset < b.offset; });
  std::vector<char> buffer(1 << 20);
  const auto copy = [&](std::uint64_t at, std::uint64_t until) {
    for (std::uint64_t count; at < until; at += count) {
      count = from.read(at, buffer.data(), std::min<std::uint64_t>(buffer.size(), until - at));
      to.write(at, buffer.data(), count);
    }
  };
  std::uint64_t at = 0;
  for (const auto& entry : entries)
    if (holds_displacements(entry)) copy(at, entry.offset), at = entry.offset + entry.bytes;
  copy(at, end);
}

}  // namespace

std::filesystem::path part_of(const std::filesystem::path& target) {
  return beside(target, ".part");
}
std::filesystem::path journal_of(const std::filesystem::path& target) {
  return beside(target, ".journal");
}

ResumablePart::ResumablePart(std::filesystem::path target)
    : target_(std::move(target)),
      part_(part_of(target_)),
      journal_path_(journal_of(target_)),
      new_part_(beside(part_, ".new")),
      lock_((check_target(target_), RunLock::of_run(journal_path_))) {
  if (const auto text = ColumnJournal::fingerprint_of(journal_path_))
    if (const auto json = Fingerprint::parse(*text, nullptr, false); json.is_object()) earlier_ = json;
}

ResumablePart::~ResumablePart() {
  leave();
}

std::vector<SectionEntry> ResumablePart::begin(const Fingerprint& fingerprint, const Content& content,
                                               std::span<const ColumnBatch> batches, const ReciprocitySample& sample) {
  const std::lock_guard lock(mutex_);
  const bool part_is_there = std::filesystem::exists(part_);
  const std::string different = earlier_ ? difference(*earlier_, fingerprint) : "";
  resumes_ = part_is_there && earlier_ && different.empty();
  if (!resumes_) {
    if (part_is_there)
      note(fmt::format("{} is begun anew: {}", part_.string(),
                       earlier_ ? different : "its journal is missing or damaged"));
    // The journal is removed first: without it no run uses the old rows. The old part must not take disk space from the
    // new.
    PlainFile(journal_path_, O_RDWR).resize(0);
    std::filesystem::remove(part_);
    earlier_.reset();
  } else if (earlier_->value("processor", "") != fingerprint.value("processor", "")) {
    warn(fmt::format(
        "{} was begun on another processor ({}): the bundle holds its tolerance, but is not the same to the "
        "byte as one made in one go; remove it to begin anew",
        part_.string(), earlier_->value("processor", "")));
  }
  auto entries = lay_out_bundle(new_part_, content.sections, content.provenance);
  {
    SectionWriter writer(new_part_);
    content.write_known(writer, entries);
  }
  if (resumes_) {
    copy_all_but_displacements(new_part_, part_, entries);
    std::filesystem::remove(new_part_);
  } else {
    PlainFile(new_part_, O_RDWR).reserve();
    replace_durably(new_part_, part_);
    ColumnJournal::begin(journal_path_, fingerprint.dump(), batches, sample);
  }
  batch_count_ = batches.size();
  journal_.emplace(journal_path_, batches, sample);
  return entries;
}

void ResumablePart::commit() {
  const std::lock_guard lock(mutex_);
  left_ = true;
  replace_durably(part_, target_);
  std::filesystem::remove(journal_path_);
  sync_folder_of(target_);
}

void ResumablePart::commit_packed(
    const std::function<void(const std::filesystem::path&, const std::filesystem::path&)>& pack) {
  pack(part_, new_part_);  // without the lock: a stop signal must not wait for it
  const std::lock_guard lock(mutex_);
  left_ = true;
  replace_durably(new_part_, target_);
  std::filesystem::remove(journal_path_);  // first: without it no run uses the old rows
  std::filesystem::remove(part_);
  sync_folder_of(target_);
}

std::size_t ResumablePart::safe_batches() const {
  std::size_t count = 0;
  for (std::size_t b = 0; journal_ && b < batch_count_; ++b) count += journal_->read(b).has_value();
  return count;
}

std::string ResumablePart::leave() {
  const std::lock_guard lock(mutex_);
  if (left_) return {};
  left_ = true;
  std::error_code ignored;
  std::filesystem::remove(new_part_, ignored);
  if (!journal_ && earlier_) return fmt::format("{} of an earlier run is as it was", part_.string());
  if (const std::size_t safe = safe_batches(); safe > 0)
    return fmt::format("{} of {} batches of columns are safe in {}: the same command resumes there", safe, batch_count_,
                       part_.string());
  std::filesystem::remove(part_, ignored);
  std::filesystem::remove(journal_path_, ignored);
  return {};
}

}  // namespace palpate
