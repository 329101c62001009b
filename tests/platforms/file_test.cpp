// file_test BUNDLE.h5 FOLDER: bundle files on Windows: names in UTF-8, what cannot be opened, and that nobody writes to an open one.
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#include <palpate/palpate_scene_def.hpp>

#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace {

int failures = 0;
void expect(bool holds, const char* what) {
  if (!holds) std::printf("failed: %s (system error %lu)\n", what, GetLastError()), ++failures;
}

std::string read_file(const char* path) {
  std::string bytes;
  if (std::FILE* in = std::fopen(path, "rb")) {
    char buffer[4096];
    for (std::size_t got; (got = std::fread(buffer, 1, sizeof buffer, in)) > 0;) bytes.append(buffer, got);
    std::fclose(in);
  }
  return bytes;
}

std::wstring wide(const std::string& utf8) {
  std::wstring result(utf8.size(), L'\0');
  result.resize(static_cast<std::size_t>(MultiByteToWideChar(CP_UTF8, 0, utf8.data(), static_cast<int>(utf8.size()),
                                                             result.data(), static_cast<int>(result.size()))));
  return result;
}

HANDLE open_for_writing(const std::string& path, DWORD how) {
  return CreateFileW(wide(path).c_str(), GENERIC_READ | GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE, nullptr, how,
                     FILE_ATTRIBUTE_NORMAL, nullptr);
}

void write_file(const std::string& path, const std::string& bytes) {
  const HANDLE file = open_for_writing(path, CREATE_ALWAYS);
  DWORD written = 0;
  expect(WriteFile(file, bytes.data(), static_cast<DWORD>(bytes.size()), &written, nullptr) && written == bytes.size(),
         "a file is written");
  CloseHandle(file);
}

palpate_bundle* open(const std::string& path, palpate_error* error, palpate_file_access access = PALPATE_FILE_MAP) {
  palpate_bundle_options options = palpate_default_bundle_options();
  options.file_access = access;
  palpate_bundle* bundle = nullptr;
  palpate_bundle_open_file(path.c_str(), &options, &bundle, error);
  return bundle;
}

void expect_refusal(const std::string& path, const char* sentence) {
  palpate_error error = {};
  expect(!open(path, &error) && error.status == PALPATE_ERROR_FILE, sentence);
  if (!std::strstr(error.text, sentence))
    std::printf("failed: \"%s\" does not say: %s\n", error.text, sentence), ++failures;
}

// The force of a press on the first touchable node, with the file's pages read and where possible locked.
double press(palpate_bundle* bundle) {
  palpate_error error = {};
  palpate_scene* scene = nullptr;
  palpate::SceneDef def;
  def.contact = PALPATE_CONTACT_NODE, def.collision = PALPATE_COLLISION_OFF;
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) return std::printf("%s\n", error.text), 0;
  const palpate_status locked = palpate_bundle_prefault(bundle, 1, &error);
  expect(locked == PALPATE_OK || (locked == PALPATE_ERROR_LOCK && std::strstr(error.text, "SetProcessWorkingSetSize")),
         "prefault locks the pages or names the limit");
  std::vector<double> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_NODE, grip.node = palpate_bundle_touchable(bundle)[0], grip.displacement[2] = -0.001;
  palpate_tool tool = palpate_default_tool();
  tool.grips = &grip, tool.grip_count = 1;
  expect(palpate_scene_touch(scene, &tool, 1, 0.001, contacts, 8 * memory.size()) == 0, "a trusted step");
  const double force = palpate_contacts_tool(contacts, 0)->force_raw[2];
  palpate_scene_destroy(scene);
  return force;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::string whole = read_file(argv[1]), folder = argv[2];
  expect(!whole.empty(), "the bundle can be read");
  CreateDirectoryW(wide(folder).c_str(), nullptr);
  const std::string path = folder +
                           "/gr\xC3\xB6\xC3\x9F"
                           "e-\xE8\x82\x9D.h5";  // German and Chinese
  write_file(path, whole);

  expect_refusal(folder + "/absent.h5", "it does not exist");
  expect_refusal(folder + "/absent/absent.h5", "it does not exist");
  expect_refusal(folder, "it is not a regular file");
  expect_refusal(folder + "/\xFF.h5", "its name is not UTF-8");
  write_file(folder + "/cut.h5", whole.substr(0, whole.size() / 2));
  palpate_error error = {};
  expect(!open(folder + "/cut.h5", &error) && error.status == PALPATE_ERROR_TRUNCATED,
         "a file that was cut is refused");
  write_file(folder + "/empty.h5", "");
  expect(!open(folder + "/empty.h5", &error), "an empty file is refused");

  // While a writer has the file, it does not open.
  const HANDLE writer = open_for_writing(path, OPEN_EXISTING);
  expect_refusal(path, "another program has it open for writing");
  CloseHandle(writer);

  // While it is open, no writer gets it, so it cannot be cut. Others may read it.
  palpate_bundle* bundle = open(path, &error);
  expect(bundle != nullptr, "a name in UTF-8 opens");
  if (!bundle) return std::printf("%s\n", error.text), 1;
  expect(open_for_writing(path, OPEN_EXISTING) == INVALID_HANDLE_VALUE && GetLastError() == ERROR_SHARING_VIOLATION,
         "no writer opens it");
  expect(open_for_writing(path, TRUNCATE_EXISTING) == INVALID_HANDLE_VALUE, "nobody cuts it");
  palpate_bundle* second = open(path, &error);
  expect(second != nullptr, "it opens twice");
  expect(palpate_bundle_check(bundle, &error) == PALPATE_OK, "its checksums hold");

  // The same bytes from memory give the same force.
  void* aligned = _aligned_malloc(whole.size(), 64);
  std::memcpy(aligned, whole.data(), whole.size());
  palpate_bundle* in_memory = nullptr;
  expect(palpate_bundle_open(aligned, whole.size(), nullptr, &in_memory, &error) == PALPATE_OK, "its bytes open");
  const double force = press(bundle), from_memory = press(in_memory);
  expect(force != 0 && force == from_memory, "file and memory give the same force");
  for (const palpate_file_access access : {PALPATE_FILE_MAP_GUARDED, PALPATE_FILE_COPY}) {
    palpate_bundle* other = open(path, &error, access);
    expect(other != nullptr, "it opens in every way");
    if (!other) continue;
    expect(palpate_bundle_check(other, &error) == PALPATE_OK, "its checksums hold in every way");
    expect(press(other) == force, "every way to open it gives the same force");
    palpate_bundle_close(other);
  }
  palpate_bundle_close(in_memory), palpate_bundle_close(second), palpate_bundle_close(bundle);
  _aligned_free(aligned);

  // Closing it gives it back.
  const HANDLE again = open_for_writing(path, TRUNCATE_EXISTING);
  expect(again != INVALID_HANDLE_VALUE, "a closed bundle's file can be written");
  CloseHandle(again);
  std::printf("force %.6f N, %d failures\n", force, failures);
  return failures == 0 ? 0 : 1;
}
