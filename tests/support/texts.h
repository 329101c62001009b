// Texts of tests: one with a part replaced, and the sentence of a refusal.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "formats/errors.h"

namespace palpate::tests {

// The text with the first `from` replaced; one must be there.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// The sentence of the InputError that a call throws; empty where it throws none.
template <class Call>
std::string input_error(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace palpate::tests
