#include "meshing/image/file_bytes.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <vector>

#include "formats/errors.h"
#include "formats/make_rule.h"

namespace palpate {
namespace {

std::ifstream open_at(const std::filesystem::path& file, std::uint64_t offset) {
  has_read(file);
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(offset));
  if (!in) throw InputError(fmt::format("{}: cannot be read", file.string()));
  return in;
}

}  // namespace

std::uint64_t file_bytes(const std::filesystem::path& file) {
  has_read(file);
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw InputError(fmt::format("{}: expected a file, found {}; check the path", file.string(),
                                 std::filesystem::exists(file, error) ? "something else" : "nothing"));
  }
  const std::uint64_t bytes = std::filesystem::file_size(file, error);
  if (error) throw InputError(fmt::format("{}: cannot be read: {}", file.string(), error.message()));
  if (bytes == 0) throw InputError(fmt::format("{}: the file is empty", file.string()));
  return bytes;
}

bool is_gzip(const std::filesystem::path& file) {
  std::ifstream in = open_at(file, 0);
  return in.get() == 0x1f && in.get() == 0x8b;
}

std::string read_head(const std::filesystem::path& file, std::size_t limit) {
  file_bytes(file);
  std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(file.c_str(), "rb"), gzclose);
  if (!in) throw InputError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)));
  std::string head(limit, '\0');
  const int count = gzread(in.get(), head.data(), static_cast<unsigned>(limit));
  if (count < 0) throw InputError(fmt::format("{}: the gzip stream is corrupt; copy the file again", file.string()));
  head.resize(static_cast<std::size_t>(count));
  return head;
}

FileBytes bytes_from(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t most) {
  const std::uint64_t size = file_bytes(file);
  FileBytes result;
  result.present = size - std::min(size, offset);
  if (result.present < most) most = 0;
  std::ifstream in = open_at(file, offset);
  result.bytes.resize(most);
  in.read(result.bytes.data(), static_cast<std::streamsize>(most));
  if (!in) throw InputError(fmt::format("{}: cannot be read to its end", file.string()));
  return result;
}

namespace {

// Keeps the bytes of a stream behind the first skipped ones, up to most.
class Keeper {
 public:
  Keeper(std::uint64_t skipped, std::uint64_t most) : skipped_(skipped), most_(most) {}
  void add(const unsigned char* bytes, std::uint64_t count) {
    const std::uint64_t passed = std::min(count, skipped_ - std::min(skipped_, total_));
    total_ += count;
    const std::uint64_t kept = std::min(count - passed, most_ - result_.bytes.size());
    result_.bytes.append(reinterpret_cast<const char*>(bytes) + passed, kept);
    result_.present += count - passed;
  }
  std::uint64_t total() const { return total_; }
  FileBytes take() { return std::move(result_); }

 private:
  std::uint64_t skipped_, most_, total_ = 0;
  FileBytes result_;
};

}  // namespace

FileBytes inflated_bytes(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t skipped,
                         std::uint64_t most) {
  std::ifstream in = open_at(file, offset);
  std::vector<unsigned char> packed(1 << 16), plain(1 << 18);
  z_stream stream{};
  if (inflateInit2(&stream, 32 + 15) != Z_OK)
    throw OperationError("zlib cannot start");  // 32: zlib detects gzip or zlib itself
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, inflateEnd);
  Keeper keeper(skipped, most);
  int state = Z_OK;
  while (true) {
    if (stream.avail_in == 0) {
      in.read(reinterpret_cast<char*>(packed.data()), static_cast<std::streamsize>(packed.size()));
      stream.next_in = packed.data();
      stream.avail_in = static_cast<unsigned>(in.gcount());
      if (stream.avail_in == 0) break;
    }
    if (state == Z_STREAM_END) {  // a gzip file may hold several members; other bytes behind the end are ignored
      if (*stream.next_in != 0x1f || inflateReset(&stream) != Z_OK) break;
    }
    stream.next_out = plain.data();
    stream.avail_out = static_cast<unsigned>(plain.size());
    state = inflate(&stream, Z_NO_FLUSH);
    keeper.add(plain.data(), plain.size() - stream.avail_out);
    if (state != Z_OK && state != Z_STREAM_END && state != Z_BUF_ERROR) {
      throw InputError(fmt::format("{}: the compressed data is corrupt after {} bytes ({}); copy the file again",
                                   file.string(), keeper.total(), stream.msg ? stream.msg : "zlib"));
    }
  }
  if (state != Z_STREAM_END) {
    throw InputError(fmt::format("{}: the compressed data is cut off after {} bytes; copy the file again",
                                 file.string(), keeper.total()));
  }
  return keeper.take();
}

}  // namespace palpate
