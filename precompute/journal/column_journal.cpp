#include "precompute/journal/column_journal.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cstring>

#include "formats/checksum.h"
#include "formats/errors.h"

namespace palpate {
namespace {

constexpr char kMagic[8] = {'P', 'A', 'L', 'J', 'R', 'N', 'L', '1'};
constexpr std::uint64_t kPage =
    4096;  // two records share no page, so that ranks on different machines never write the same one
constexpr std::uint64_t kLongestFingerprint = 1 << 20;

struct Header {
  char magic[8];
  std::uint64_t fingerprint_bytes;
  std::uint64_t checksum;  // XXH64 of the fingerprint
};

struct RecordHeader {
  std::uint64_t batch, bytes;
  std::uint64_t checksum;  // XXH64 of the header's checksum, batch, bytes and the record
};

std::uint64_t whole_pages(std::uint64_t bytes) {
  return (bytes + kPage - 1) / kPage * kPage;
}

std::uint64_t record_checksum(std::uint64_t seed, const RecordHeader& header, std::span<const std::byte> record) {
  formats::Xxh64 checksum;
  checksum.update(&seed, sizeof seed);
  checksum.update(&header, offsetof(RecordHeader, checksum));
  checksum.update(record.data(), record.size());
  return checksum.digest();
}

// Header and fingerprint; nothing where they are not whole.
std::optional<std::pair<Header, std::string>> read_header(const PlainFile& file) {
  Header header{};
  if (file.read(0, &header, sizeof header) < sizeof header || std::memcmp(header.magic, kMagic, sizeof kMagic) != 0 ||
      header.fingerprint_bytes > kLongestFingerprint)
    return {};
  std::string fingerprint(header.fingerprint_bytes, '\0');
  if (file.read(sizeof header, fingerprint.data(), fingerprint.size()) < fingerprint.size() ||
      formats::xxh64(fingerprint.data(), fingerprint.size()) != header.checksum)
    return {};
  return std::pair(header, std::move(fingerprint));
}

// Calls take(offset, bytes) for the record of each batch; returns the bytes of the whole file.
std::uint64_t lay_out_records(std::uint64_t fingerprint_bytes, std::span<const ColumnBatch> batches,
                              const ReciprocitySample& sample, auto&& take) {
  std::uint64_t offset = whole_pages(sizeof(Header) + fingerprint_bytes);
  for (const auto& batch : batches) {
    const std::uint64_t bytes = record_bytes(batch, sample);
    take(offset, bytes);
    offset += whole_pages(sizeof(RecordHeader) + bytes);
  }
  return offset;
}

}  // namespace

void ColumnJournal::begin(const std::filesystem::path& path, const std::string& fingerprint,
                          std::span<const ColumnBatch> batches, const ReciprocitySample& sample) {
  const PlainFile file(path, O_RDWR);
  file.resize(0);
  file.resize(lay_out_records(fingerprint.size(), batches, sample, [](auto, auto) {}));
  file.reserve();
  file.sync();
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.fingerprint_bytes = fingerprint.size();
  header.checksum = formats::xxh64(fingerprint.data(), fingerprint.size());
  file.write(sizeof header, fingerprint.data(), fingerprint.size());
  file.write(0, &header, sizeof header);
  file.sync();
}

std::optional<std::string> ColumnJournal::fingerprint_of(const std::filesystem::path& path) {
  const PlainFile file(path, O_RDONLY);
  auto found = read_header(file);
  if (!found) return {};
  return std::move(found->second);
}

ColumnJournal::ColumnJournal(const std::filesystem::path& path, std::span<const ColumnBatch> batches,
                             const ReciprocitySample& sample)
    : file_(path, O_RDWR), batches_(batches) {
  const auto found = read_header(file_);
  if (!found) throw OperationError(fmt::format("{}: changed while it was in use", path.string()));
  seed_ = found->first.checksum;
  lay_out_records(found->second.size(), batches, sample, [this](std::uint64_t offset, std::uint64_t bytes) {
    records_.push_back({offset, bytes});
  });
}

void ColumnJournal::write(std::size_t batch, const BatchRecord& record) const {
  const std::vector<std::byte> bytes = to_bytes(record);
  RecordHeader header{batch, bytes.size(), 0};
  header.checksum = record_checksum(seed_, header, bytes);
  std::vector<std::byte> whole(sizeof header + bytes.size());
  std::memcpy(whole.data(), &header, sizeof header);
  std::memcpy(whole.data() + sizeof header, bytes.data(), bytes.size());
  file_.write(records_[batch].offset, whole.data(), whole.size());
}

std::optional<BatchRecord> ColumnJournal::read(std::size_t batch) const {
  const auto [offset, bytes] = records_[batch];
  std::vector<std::byte> whole(sizeof(RecordHeader) + bytes);
  if (file_.read(offset, whole.data(), whole.size()) < whole.size()) return {};
  RecordHeader header{};
  std::memcpy(&header, whole.data(), sizeof header);
  const auto record = std::span<const std::byte>(whole).subspan(sizeof header);
  if (header.batch != batch || header.bytes != bytes || header.checksum != record_checksum(seed_, header, record))
    return {};
  return from_bytes(record, batches_[batch]);
}

}  // namespace palpate
