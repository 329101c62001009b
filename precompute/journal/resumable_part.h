// The unfinished bundle, NAME.part, and its journal, on rank 0. A run begins them or finds those of an earlier run, and
// turns the part into the bundle when all columns are there.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
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
  ~ResumablePart();  // calls leave()

  // The fingerprint of an earlier run on the same output that was killed or failed; nothing where there is none.
  const std::optional<Fingerprint>& earlier() const { return earlier_; }

  struct Content {
    std::vector<SectionShape> sections;
    std::string provenance;  // with spaces at its end, where the numbers of the certificate will need them
    std::function<void(SectionWriter&, const std::vector<formats::SectionEntry>&)>
        write_known;  // writes all sections but those of the columns
  };
  // Lays the part out. Where the earlier run had the same fingerprint, its displacement rows are kept and everything
  // else is written anew; else the part is begun anew, and a note says why. Errors: OperationError.
  std::vector<formats::SectionEntry> begin(const Fingerprint& fingerprint, const Content& content,
                                           std::span<const ColumnBatch> batches, const ReciprocitySample& sample);
  bool resumes() const { return resumes_; }

  // Renames the sealed part to the bundle and removes the journal. Errors: OperationError.
  void commit();

  // The same, but the bundle is what pack writes to its second argument from the sealed part, its first argument. Where pack
  // throws or the run is stopped meanwhile, part and journal stay, and a rerun resumes from them.
  void commit_packed(const std::function<void(const std::filesystem::path&, const std::filesystem::path&)>& pack);

  // Ends the run without a bundle: keeps part and journal where at least one batch is safe in them, else removes them.
  // Returns a sentence on what is kept; empty where nothing is, after commit(), and at a second call. May be called
  // from any thread.
  std::string leave();

 private:
  std::size_t safe_batches() const;

  std::filesystem::path target_, part_, journal_path_, new_part_;
  RunLock lock_;
  std::optional<Fingerprint> earlier_;
  bool resumes_ = false, left_ = false;
  std::size_t batch_count_ = 0;
  std::optional<ColumnJournal> journal_;
  std::mutex mutex_;  // leave() may be called by the thread that waits for signals
};

}  // namespace palpate
