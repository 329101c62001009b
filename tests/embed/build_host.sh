#!/bin/sh
# build_host.sh WAY PALPATE SOURCE FOLDER BUNDLE CMAKE: builds the README's examples as C99 and C++17 programs of a host and runs
# them on BUNDLE. WAY: subdirectory (PALPATE: the sources), package (CMake), or pkg-config with only a
# compiler (PALPATE: the prefix of an installation).
# For another platform the environment has CMAKE_TOOLCHAIN_FILE, CC, CXX and OBJDUMP; RUN, the program that runs its programs; and
# EXE, what their names end with.
set -eu
way=$1 palpate=$2 source=$3 folder=$4 bundle=$5 cmake=$6
rm -rf "$folder"
mkdir -p "$folder"
build_host() {
  "$cmake" -S "$source/tests/embed/host" -B "$folder/build" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@"
  "$cmake" --build "$folder/build" -j 2
  cp "$folder/build/example_C${EXE:-}" "$folder/build/example_CXX${EXE:-}" "$folder"
}
case $way in
  subdirectory) build_host -DPALPATE_SOURCE="$palpate" ;;
  package) build_host -DCMAKE_PREFIX_PATH="$palpate" ;;
  pkg-config)
    PKG_CONFIG_PATH=$(dirname "$(find "$palpate" -name palpate.pc)")
    LD_LIBRARY_PATH=$(dirname "$PKG_CONFIG_PATH")
    export PKG_CONFIG_PATH LD_LIBRARY_PATH
    static=--static
    if test -e "$LD_LIBRARY_PATH/libpalpate.so" || test -e "$LD_LIBRARY_PATH/libpalpate.dll.a"; then static=; fi
    ${CC:-cc} -std=c99 -pedantic-errors -Wall -Wextra -Werror "$source/tests/embed/example.c" -o "$folder/example_C${EXE:-}" \
      $(pkg-config --cflags --libs $static palpate)
    ${CXX:-c++} -std=c++17 -pedantic-errors -Wall -Wextra -Werror "$source/tests/embed/example.cpp" -o "$folder/example_CXX${EXE:-}" \
      $(pkg-config --cflags --libs $static palpate)
    ;;
esac
run() { ${RUN:+"$RUN"} "$@"; }
run "$folder/example_C${EXE:-}" "$bundle" > "$folder/c.txt"
run "$folder/example_CXX${EXE:-}" "$bundle" > "$folder/cpp.txt"
cat "$folder/c.txt" "$folder/cpp.txt"
grep -q "nodes drawn, flags 0" "$folder/c.txt"
# Expected: no force above the surface, and at the end a force that pushes the needle out.
grep -q "   0 ms   0.0000 N" "$folder/cpp.txt"
awk '/1000 ms/ { found = 1; if ($3 <= 0) exit 1 } END { exit !found }' "$folder/cpp.txt"
if run "$folder/example_C${EXE:-}" "$folder/absent.h5"; then exit 1; else test $? -eq 2; fi
# A host in C must not need a C++ library.
if ${OBJDUMP:-objdump} -p "$folder/example_C${EXE:-}" | grep -E '(NEEDED|DLL Name).*(stdc|gcc)'; then exit 1; fi
${OBJDUMP:-objdump} -p "$folder/example_C${EXE:-}" | grep -q -E '(NEEDED|DLL Name)'  # it does name what it needs
