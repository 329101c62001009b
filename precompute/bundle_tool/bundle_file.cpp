#include "precompute/bundle_tool/bundle_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "formats/checksum.h"

namespace palpate {

using namespace formats;

namespace {

// Fewer than count bytes when the file ends before.
std::uint64_t read_at(int descriptor, std::uint64_t offset, void* bytes, std::uint64_t count) {
  std::uint64_t done = 0;
  while (done < count) {
    const ssize_t got = ::pread(descriptor, static_cast<char*>(bytes) + done,
                                std::min<std::uint64_t>(count - done, 1u << 30), static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::uint64_t>(got);
  }
  return done;
}

}  // namespace

BundleFile::BundleFile(std::filesystem::path file) : path_(std::move(file)) {
  const auto refuse = [&](const std::string& what, BundleStatus status) {
    if (descriptor_ >= 0) ::close(descriptor_);
    throw BundleRefused(fmt::format("{}: {}", path_.string(), what), status);
  };
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // to open a pipe must not block
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0)
    refuse(fmt::format("cannot be read: {}", std::strerror(errno)), BundleStatus::magic);
  if (!S_ISREG(status.st_mode))
    refuse("expected a tensor bundle, found something that is no file", BundleStatus::magic);

  const auto file_bytes = static_cast<std::uint64_t>(status.st_size);
  unsigned char head[kUserBlockBytes] = {};
  const std::uint64_t wanted = std::min(file_bytes, kUserBlockBytes);
  if (read_at(descriptor_, 0, head, wanted) != wanted)
    refuse("its first bytes cannot be read", BundleStatus::truncated);
  BundleError error;
  if (read_bundle_index(head, file_bytes, &index_, &error) != BundleStatus::ok)
    refuse(fmt::format("byte {}: {}", error.byte_offset, error.text), error.status);
}

BundleFile::~BundleFile() {
  ::close(descriptor_);
}

void BundleFile::read(const SectionEntry& entry, std::uint64_t first, void* bytes, std::uint64_t count) const {
  if (first > entry.bytes || count > entry.bytes - first) throw std::logic_error("a read outside a section");
  if (read_at(descriptor_, entry.offset + first, bytes, count) != count)
    throw OperationError(fmt::format("{}: {} cannot be read at byte {}: the file changed or the disk failed",
                                     path_.string(), section_name(entry), entry.offset + first));
}

std::string BundleFile::text(SectionId id) const {
  const std::vector<char> bytes = numbers<char>(id);
  return {bytes.begin(), bytes.end()};
}

nlohmann::json BundleFile::provenance() const {
  auto json = nlohmann::json::parse(text(SectionId::provenance), nullptr, false);
  if (!json.is_object()) return nullptr;
  for (const auto& value : json)
    if (value.is_structured()) return nullptr;
  return json;
}

std::vector<std::string> BundleFile::region_names() const {
  std::vector<std::string> names;
  std::string name;
  for (const char c : text(SectionId::region_names)) {
    if (c != '\n') {
      name += c;
    } else {
      names.push_back(std::move(name));
      name.clear();
    }
  }
  if (!name.empty()) names.push_back(name);
  return names;
}

std::uint64_t BundleFile::checksum(const SectionEntry& entry) const {
  Xxh64 state;
  std::vector<char> buffer(1 << 20);
  for (std::uint64_t done = 0; done < entry.bytes;) {
    const std::uint64_t count = std::min<std::uint64_t>(buffer.size(), entry.bytes - done);
    read(entry, done, buffer.data(), count);
    state.update(buffer.data(), count);
    done += count;
  }
  return state.digest();
}

std::string section_name(const SectionEntry& entry) {
  const SectionDescription* section = describe_section(static_cast<SectionId>(entry.id));
  return section ? section->path : fmt::format("section {}", entry.id);
}

std::string type_name(std::uint32_t type) {
  constexpr const char* kNames[] = {"", "f64", "f32", "i32", "u8", "text", "f16"};  // by ElementType
  if (type > 0 && type < std::size(kNames)) return kNames[type];
  return fmt::format("type {}", type);
}

std::string shape_text(const SectionEntry& entry) {
  const auto rank = std::min(entry.rank, kMaxRank);
  return fmt::format("({})", fmt::join(entry.shape, entry.shape + rank, ", "));
}

std::optional<double> number_of(const nlohmann::json& object, const char* key) {
  if (!object.contains(key) || !object[key].is_number()) return std::nullopt;
  return object[key].get<double>();
}

std::string printable(const std::string& text) {
  std::string shown = text;
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  return shown;
}

std::string json_text(const nlohmann::json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace palpate
