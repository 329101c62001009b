#include "precompute/journal/column_journal.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cstring>

#include "formats/checksum.h"
#include "formats/errors.h"

namespace palpate {
namespace {

constexpr char kMagic[8] = {'P', 'A', 'L', 'J', 'R', 'N', 'L', '1'};
constexpr std::uint64_t kPage = 4096;  // slots share none: neither a disk's sector nor a client's cache page
constexpr std::uint64_t kLongestFingerprint = 1 << 20;

struct Header {
  char magic[8];
  std::uint64_t fingerprint_bytes;
  std::uint64_t checksum;  // XXH64 of the fingerprint
};

struct SlotHeader {
  std::uint64_t block, bytes;
  std::uint64_t checksum;  // XXH64 of the header's checksum, block, bytes and the record
};

std::uint64_t whole_pages(std::uint64_t bytes) {
  return (bytes + kPage - 1) / kPage * kPage;
}

std::uint64_t slot_checksum(std::uint64_t seed, const SlotHeader& slot, std::span<const std::byte> record) {
  formats::Xxh64 checksum;
  checksum.update(&seed, sizeof seed);
  checksum.update(&slot, offsetof(SlotHeader, checksum));
  checksum.update(record.data(), record.size());
  return checksum.digest();
}

// Header and fingerprint, or nothing.
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

// Bytes of the whole file.
std::uint64_t lay_out_slots(std::uint64_t fingerprint_bytes, std::span<const ColumnBlock> blocks,
                            const ReciprocitySample& sample, auto&& take) {
  std::uint64_t offset = whole_pages(sizeof(Header) + fingerprint_bytes);
  for (const auto& block : blocks) {
    const std::uint64_t bytes = record_bytes(block, sample);
    take(offset, bytes);
    offset += whole_pages(sizeof(SlotHeader) + bytes);
  }
  return offset;
}

}  // namespace

void ColumnJournal::begin(const std::filesystem::path& path, const std::string& fingerprint,
                          std::span<const ColumnBlock> blocks, const ReciprocitySample& sample) {
  const PlainFile file(path, O_RDWR);
  file.resize(0);
  file.resize(lay_out_slots(fingerprint.size(), blocks, sample, [](auto, auto) {}));
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

ColumnJournal::ColumnJournal(const std::filesystem::path& path, std::span<const ColumnBlock> blocks,
                             const ReciprocitySample& sample)
    : file_(path, O_RDWR), blocks_(blocks) {
  const auto found = read_header(file_);
  if (!found) throw OperationError(fmt::format("{}: changed while it was in use", path.string()));
  seed_ = found->first.checksum;
  lay_out_slots(found->second.size(), blocks, sample, [this](std::uint64_t offset, std::uint64_t bytes) {
    slots_.push_back({offset, bytes});
  });
}

void ColumnJournal::write(std::size_t block, const BlockRecord& record) const {
  const std::vector<std::byte> bytes = to_bytes(record);
  SlotHeader slot{block, bytes.size(), 0};
  slot.checksum = slot_checksum(seed_, slot, bytes);
  std::vector<std::byte> whole(sizeof slot + bytes.size());
  std::memcpy(whole.data(), &slot, sizeof slot);
  std::memcpy(whole.data() + sizeof slot, bytes.data(), bytes.size());
  file_.write(slots_[block].offset, whole.data(), whole.size());
}

std::optional<BlockRecord> ColumnJournal::read(std::size_t block) const {
  const auto [offset, bytes] = slots_[block];
  std::vector<std::byte> whole(sizeof(SlotHeader) + bytes);
  if (file_.read(offset, whole.data(), whole.size()) < whole.size()) return {};
  SlotHeader slot{};
  std::memcpy(&slot, whole.data(), sizeof slot);
  const auto record = std::span<const std::byte>(whole).subspan(sizeof slot);
  if (slot.block != block || slot.bytes != bytes || slot.checksum != slot_checksum(seed_, slot, record)) return {};
  return from_bytes(record, blocks_[block]);
}

}  // namespace palpate
