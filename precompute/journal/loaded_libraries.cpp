#include "precompute/journal/loaded_libraries.h"

#include <elf.h>
#include <link.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <vector>

#include "formats/program.h"

namespace palpate {
namespace {

struct Library {
  std::string path;                 // empty: the program itself
  std::string name;                 // that others call it by, "libm.so.6"
  std::string build_id;             // hexadecimal; empty where it has none
  std::vector<std::string> needed;  // names
};

// The note that ld --build-id leaves: sizes and type in 4 bytes each, "GNU", the id.
std::string build_id_in(const char* notes, std::size_t bytes) {
  const auto padded = [](std::size_t size) { return (size + 3) / 4 * 4; };
  while (bytes >= sizeof(ElfW(Nhdr))) {
    ElfW(Nhdr) note;
    std::memcpy(&note, notes, sizeof note);
    const std::size_t whole = sizeof note + padded(note.n_namesz) + padded(note.n_descsz);
    if (whole > bytes) break;
    const char* name = notes + sizeof note;
    if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && std::memcmp(name, "GNU", 4) == 0) {
      std::string id;
      for (std::size_t i = 0; i < note.n_descsz; ++i) {
        const auto byte = static_cast<unsigned char>(name[4 + i]);
        id += "0123456789abcdef"[byte / 16];
        id += "0123456789abcdef"[byte % 16];
      }
      return id;
    }
    notes += whole, bytes -= whole;
  }
  return {};
}

// The table of names is found by an address, which most systems' loaders have turned from the file's into memory's.
void read_names(const ElfW(Dyn) * dynamic, ElfW(Addr) base, Library& library) {
  const char* names = nullptr;
  for (const auto* d = dynamic; d->d_tag != DT_NULL; ++d)
    if (d->d_tag == DT_STRTAB)
      names = reinterpret_cast<const char*>(d->d_un.d_ptr < base ? base + d->d_un.d_ptr : d->d_un.d_ptr);
  for (const auto* d = dynamic; names && d->d_tag != DT_NULL; ++d) {
    if (d->d_tag == DT_SONAME) library.name = names + d->d_un.d_val;
    if (d->d_tag == DT_NEEDED) library.needed.emplace_back(names + d->d_un.d_val);
  }
}

int take_library(dl_phdr_info* info, std::size_t, void* into) {
  Library library;
  library.path = info->dlpi_name;
  library.name = std::filesystem::path(library.path).filename();
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const auto& part = info->dlpi_phdr[i];
    const ElfW(Addr) at = info->dlpi_addr + part.p_vaddr;
    if (part.p_type == PT_DYNAMIC) read_names(reinterpret_cast<const ElfW(Dyn)*>(at), info->dlpi_addr, library);
    if (part.p_type == PT_NOTE && library.build_id.empty())
      library.build_id = build_id_in(reinterpret_cast<const char*>(at), part.p_memsz);
  }
  static_cast<std::vector<Library>*>(into)->push_back(std::move(library));
  return 0;
}

bool starts_with_one_of(const std::string& name, std::initializer_list<const char*> beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(), [&](const char* b) { return name.rfind(b, 0) == 0; });
}

// They compute no number of a bundle: an upgrade is no reason to begin anew.
bool is_of_no_matter(const std::string& name) {
  return starts_with_one_of(name, {"libX11", "libssl", "libcrypto"});
}

// They move and store numbers; what they need in turn (network, events, compression) computes none.
bool is_the_last_that_matters(const std::string& name) {
  return starts_with_one_of(name, {"libmpi", "libhdf5"});
}

}  // namespace

std::map<std::string, std::string> needed_libraries() {
  std::vector<Library> loaded;  // the program first
  dl_iterate_phdr(take_library, &loaded);
  std::map<std::string, std::string> result;
  std::vector<std::string> wanted = loaded.empty() ? std::vector<std::string>() : loaded.front().needed;
  while (!wanted.empty()) {
    const std::string name = wanted.back();
    wanted.pop_back();
    const std::string key = name.substr(0, name.find(".so") + 3);
    if (result.contains(key) || is_of_no_matter(name)) continue;
    for (const auto& library : loaded) {
      if (library.name != name || library.path.empty()) continue;
      result[key] = library.build_id.empty() ? sha256_of_file(library.path) : library.build_id;
      if (!is_the_last_that_matters(name)) wanted.insert(wanted.end(), library.needed.begin(), library.needed.end());
      break;
    }
  }
  return result;
}

}  // namespace palpate
