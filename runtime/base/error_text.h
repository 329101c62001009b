// Fills the caller's palpate_error. Nothing here allocates.
#pragma once

#include <cstdarg>
#include <cstdio>

#include "formats/bundle_reader.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

#if defined(__GNUC__)
__attribute__((format(printf, 4, 5)))
#endif
inline palpate_status
fail(palpate_error* error, palpate_status status, std::uint64_t offset, const char* format, ...) {
  if (error) {
    error->status = status;
    error->byte_offset = offset;
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
  }
  return status;
}

inline palpate_status succeed(palpate_error* error) {
  if (error) *error = palpate_error{};
  return PALPATE_OK;
}

// formats::BundleStatus has the same numbers as palpate_status.
inline palpate_status fail(palpate_error* error, const formats::BundleError& from) {
  return fail(error, static_cast<palpate_status>(from.status), from.byte_offset, "%s", from.text);
}

}  // namespace palpate
