// Writes a TetrahedralMesh as MSH 2.2 ASCII, 2.2 binary and 4.1 binary, independently of formats/, whose writer makes 4.1
// ASCII.
#pragma once

#include <cstdio>
#include <string>
#include <type_traits>

#include "formats/tetrahedral_mesh.h"

namespace palpate::tests {

// Words separated by blanks, with a line end.
template <class... Words>
void put_line(std::string& out, const Words&... words) {
  const auto put = [&](const auto& word) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(word)>>)
      out.append(std::to_string(word));
    else
      out.append(word);
    out.push_back(' ');
  };
  (put(words), ...);
  out.back() = '\n';
}
template <class Number>
void put_raw(std::string& out, Number number) {
  out.append(reinterpret_cast<const char*>(&number), sizeof number);
}
std::string exact(double x);

std::string msh_names(const TetrahedralMesh& mesh);

std::size_t msh_element_count(const TetrahedralMesh& mesh);

std::string msh2_ascii(const TetrahedralMesh& mesh);

std::string msh2_binary(const TetrahedralMesh& mesh);

// Node numbers descend from 1000 + N: readers must not rely on consecutive or ascending numbers.
std::string msh4_binary(const TetrahedralMesh& mesh);

}  // namespace palpate::tests
