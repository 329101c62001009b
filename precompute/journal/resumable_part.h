// NAME.part and NAME.journal on rank 0: begun anew or found again, and in the end the bundle.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "formats/bundle_writer.h"
#include "precompute/journal/column_journal.h"
#include "precompute/journal/fingerprint.h"
#include "precompute/journal/run_lock.h"

namespace palpate {

std::filesystem::path part_of(const std::filesystem::path& target);
std::filesystem::path journal_of(const std::filesystem::path& target);

class ResumablePart {
 public:
  // Errors: those of check_target and of RunLock::of_run.
  explicit ResumablePart(std::filesystem::path target);
  ResumablePart(const ResumablePart&) = delete;
  ResumablePart& operator=(const ResumablePart&) = delete;
  ~ResumablePart();  // as leave()

  // What an earlier run was begun with, where one was killed or failed.
  const std::optional<Fingerprint>& earlier() const { return earlier_; }

  struct Content {
    std::vector<SectionShape> sections;
    std::string provenance;  // with room for its numbers
    std::function<void(SectionWriter&, const std::vector<formats::SectionEntry>&)> write_known;  // all but the columns
  };
  // Lays the part out. Resumes where the fingerprint is that of the earlier run: then the displacement rows are kept and
  // everything else is written anew. Says which, and why. Errors: OperationError.
  std::vector<formats::SectionEntry> begin(const Fingerprint& fingerprint, const Content& content,
                                           std::span<const ColumnBlock> blocks, const ReciprocitySample& sample);
  bool resumes() const { return resumes_; }

  // The sealed part becomes the bundle, and the journal goes. Errors: OperationError.
  void commit();

  // Ends without a bundle: keeps part and journal where a block of columns is safe in them, else removes them. Returns
  // what is kept, in words; empty where nothing is, or when called before. From any thread.
  std::string leave();

 private:
  std::size_t safe_blocks() const;

  std::filesystem::path target_, part_, journal_path_, new_part_;
  RunLock lock_;
  std::optional<Fingerprint> earlier_;
  bool resumes_ = false, left_ = false;
  std::size_t block_count_ = 0;
  std::optional<ColumnJournal> journal_;
  std::mutex mutex_;  // leave() comes from the thread that waits for signals
};

}  // namespace palpate
