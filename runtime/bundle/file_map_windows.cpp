// The file maps of file_map.h on Windows.
//
// While a bundle is open, Windows lets nobody write to its file: the file is opened without FILE_SHARE_WRITE. So it can neither be
// cut nor written over, and there is nothing to witness. A file on a network drive whose server goes away is another matter:
// reading its pages raises EXCEPTION_IN_PAGE_ERROR in the host.
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>

#include <algorithm>
#include <cstdlib>

#include "runtime/bundle/file_map.h"

namespace palpate {
namespace {

// Of a handle of 64 bits Windows uses 32 alone, sign-extended, so that a handle fits an int and INVALID_HANDLE_VALUE is -1.
int descriptor_of(HANDLE handle) {
  return static_cast<int>(reinterpret_cast<std::intptr_t>(handle));
}
HANDLE handle_of(int descriptor) {
  return reinterpret_cast<HANDLE>(static_cast<std::intptr_t>(descriptor));
}

const char* reason_of(DWORD error) {
  switch (error) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_NAME:
      return "it does not exist";
    case ERROR_SHARING_VIOLATION:
      return "another program has it open for writing";
    case ERROR_ACCESS_DENIED:
      return "reading it is not permitted";
    default:
      return "the system refused to open it";
  }
}

// The path in UTF-16, to be released with free; nullptr where it is not UTF-8 or there is no memory.
wchar_t* wide_path(const char* path) {
  const int count = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, nullptr, 0);
  if (count <= 0) return nullptr;
  auto* wide = static_cast<wchar_t*>(std::malloc(sizeof(wchar_t) * static_cast<std::size_t>(count)));
  if (wide) MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, count);
  return wide;
}

SYSTEM_INFO system_info() {
  SYSTEM_INFO info = {};
  GetSystemInfo(&info);
  return info;
}

}  // namespace

bool file_maps_are_supported() {
  return true;
}

int open_for_map(const char* path, std::uint64_t* file_bytes, const char** reason) {
  wchar_t* wide = wide_path(path);
  if (!wide) {
    *reason = "its name is not UTF-8";
    return -1;
  }
  const HANDLE file = CreateFileW(wide, GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_DELETE, nullptr, OPEN_EXISTING,
                                  FILE_ATTRIBUTE_NORMAL, nullptr);
  const DWORD error = GetLastError();
  const DWORD attributes = GetFileAttributesW(wide);
  std::free(wide);
  const bool is_folder = attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY);
  if (file == INVALID_HANDLE_VALUE) {
    *reason = is_folder ? "it is not a regular file" : reason_of(error);
    return -1;
  }
  LARGE_INTEGER size = {};
  if (is_folder || GetFileType(file) != FILE_TYPE_DISK || !GetFileSizeEx(file, &size)) {
    *reason = "it is not a regular file";
    CloseHandle(file);
    return -1;
  }
  *file_bytes = static_cast<std::uint64_t>(size.QuadPart);
  return descriptor_of(file);
}

void close_file(int descriptor) {
  CloseHandle(handle_of(descriptor));
}

bool read_range(int descriptor, std::uint64_t offset, void* out, std::size_t count) {
  std::size_t done = 0;
  while (done < count) {
    OVERLAPPED at = {};  // a position; the read itself waits
    at.Offset = static_cast<DWORD>(offset + done);
    at.OffsetHigh = static_cast<DWORD>((offset + done) >> 32);
    constexpr std::size_t kMost = std::size_t{1} << 30;  // ReadFile takes 32 bits
    const auto wanted = static_cast<DWORD>(std::min(count - done, kMost));
    DWORD got = 0;
    if (!ReadFile(handle_of(descriptor), static_cast<char*>(out) + done, wanted, &got, &at)) return false;
    if (got == 0) return false;
    done += got;
  }
  return true;
}

bool map_range(int descriptor, std::uint64_t offset, std::uint64_t count, std::atomic<bool>*, FileMap* map) {
  if (count == 0 || count > static_cast<std::size_t>(-1) / 2) return false;
  const std::uint64_t step = system_info().dwAllocationGranularity, first = offset / step * step;
  const HANDLE mapping = CreateFileMappingW(handle_of(descriptor), nullptr, PAGE_READONLY, 0, 0, nullptr);
  if (!mapping) return false;
  map->bytes = static_cast<std::size_t>(offset - first + count);
  map->base =
      MapViewOfFile(mapping, FILE_MAP_READ, static_cast<DWORD>(first >> 32), static_cast<DWORD>(first), map->bytes);
  CloseHandle(mapping);  // the view keeps it
  if (!map->base) {
    *map = FileMap{};
    return false;
  }
  map->data = static_cast<const unsigned char*>(map->base) + (offset - first);
  return true;
}

void unmap(FileMap* map) {
  if (map->base) UnmapViewOfFile(map->base);
  *map = FileMap{};
}

bool FileWitness::call(int, std::uint64_t, std::uint64_t, std::uint64_t, std::atomic<bool>*) {
  return true;
}
void FileWitness::dismiss() {}

void read_pages(const FileMap& map) {
  const std::size_t page = system_info().dwPageSize;
  for (std::size_t at = 0; at < map.bytes; at += page)
    static_cast<void>(*(static_cast<const volatile unsigned char*>(map.base) + at));
}

bool lock_pages(const FileMap& map, std::uint64_t* limit) {
  if (VirtualLock(map.base, map.bytes)) return true;
  SIZE_T least = 0, most = 0;
  GetProcessWorkingSetSize(GetCurrentProcess(), &least, &most);
  *limit = least;
  return false;
}

}  // namespace palpate
