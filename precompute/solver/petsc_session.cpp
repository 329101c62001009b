#include "precompute/solver/petsc_session.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "formats/errors.h"

namespace palpate {
namespace {

std::string& last_error() {
  static std::string text;
  return text;
}

std::set<std::string>& own_defaults() {
  static std::set<std::string> names = {"-skip_petscrc"};
  return names;
}

PetscErrorCode remember_error(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type,
                              const char* message, void*) {
  if (type == PETSC_ERROR_INITIAL) last_error() = message ? message : "";
  return code;
}

// BLAS may use one thread only: the ranks share the cores, and more threads would change the order of sums.
void use_one_blas_thread() {
  for (const char* name : {"openblas_set_num_threads", "bli_thread_set_num_threads"})
    if (void* found = dlsym(RTLD_DEFAULT, name)) reinterpret_cast<void (*)(int)>(found)(1);
}

}  // namespace

void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  PetscErrorMessage(code, &text, nullptr);
  std::string sentence = last_error().empty() ? (text ? text : "unknown error") : last_error();
  std::replace(sentence.begin(), sentence.end(), '\n', ' ');
  last_error().clear();
  throw OperationError(fmt::format("PETSc: {} (error {})", sentence, static_cast<int>(code)));
}

PetscSession::PetscSession(const std::vector<std::string>& options) {
  int initialised = 0;
  MPI_Initialized(&initialised);
  if (!initialised) {
    if (MPI_Init(nullptr, nullptr) != MPI_SUCCESS) throw OperationError("MPI cannot be started");
    owns_mpi_ = true;
  }
  texts_ = {"palpate-precompute", "-skip_petscrc"};
  texts_.insert(texts_.end(), options.begin(), options.end());
  for (auto& text : texts_) arguments_.push_back(text.data());
  arguments_.push_back(nullptr);
  int count = static_cast<int>(texts_.size());
  char** arguments = arguments_.data();
  check(PetscInitialize(&count, &arguments, nullptr, nullptr));
  check(PetscPushErrorHandler(remember_error, nullptr));
  // A crash must end with a signal, not with PETSc's page of advice and an exit code that means something else here.
  check(PetscPopSignalHandler());
  use_one_blas_thread();
}

PetscSession::~PetscSession() {
  PetscOptionsSetValue(nullptr, "-options_left", "no");  // the program itself refuses options that nothing used
  PetscFinalize();
  if (owns_mpi_) MPI_Finalize();
}

void set_default_petsc_option(const std::string& name, const std::string& value) {
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, name.c_str(), &given));
  if (given) return;
  check(PetscOptionsSetValue(nullptr, name.c_str(), value.c_str()));
  own_defaults().insert(name);
}

std::string unused_petsc_options() {
  PetscInt count = 0;
  char **names = nullptr, **values = nullptr;
  check(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  std::string text;
  for (PetscInt i = 0; i < count; ++i) {
    const std::string name = names[i];
    if (own_defaults().count('-' + name)) continue;
    text += (text.empty() ? "-" : ", -") + name + (values[i] ? std::string(" ") + values[i] : "");
  }
  check(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  return text;
}

namespace {

std::vector<std::string> all_options() {  // "-name value", sorted
  char* text = nullptr;
  check(PetscOptionsGetAll(nullptr, &text));
  std::vector<std::string> options;
  for (const char* at = text; at && *at;) {  // "-name value -name ..."
    const char* space = at;
    while (*space && *space != ' ') ++space;
    const std::string word(at, space);
    if (word.size() > 1 && word[0] == '-' && !std::isdigit(static_cast<unsigned char>(word[1])))
      options.push_back(word);
    else if (!options.empty())
      options.back() += ' ' + word;
    at = *space ? space + 1 : space;
  }
  PetscFree(text);
  std::sort(options.begin(), options.end());
  return options;
}

}  // namespace

std::string petsc_option_or(const char* name, const char* otherwise) {
  char text[128] = {};
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsGetString(nullptr, nullptr, name, text, sizeof text, &given));
  return given ? text : otherwise;
}

std::string petsc_options_in_force() {
  std::string line;
  for (const auto& option : all_options())
    if (option != "-skip_petscrc") line += (line.empty() ? "" : " ") + option;
  return line;
}

std::string petsc_version() {
  PetscInt major = 0, minor = 0, patch = 0;
  check(PetscGetVersionNumber(&major, &minor, &patch, nullptr));
  return fmt::format("PETSc {}.{}.{}", major, minor, patch);
}

}  // namespace palpate
