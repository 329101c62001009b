#!/bin/sh
# build_host.sh WAY SOURCE FOLDER WRITE_TINY_BUNDLE CMAKE: builds and runs the host project with Palpate as a subdirectory, or
# installed into FOLDER/prefix (static or shared) and found by CMake, or by pkg-config with the C compiler alone.
set -eu
way=$1 source=$2 folder=$3 write_tiny_bundle=$4 cmake=$5
rm -rf "$folder"
mkdir -p "$folder"
"$write_tiny_bundle" "$folder/tiny.h5"
install_palpate() {
  "$cmake" -S "$source" -B "$folder/palpate" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$folder/prefix" \
    -DPALPATE_BUILD_OFFLINE=OFF -DPALPATE_BUILD_TESTS=OFF "$@"
  "$cmake" --build "$folder/palpate" -j 2
  "$cmake" --install "$folder/palpate" --component runtime
}
build_host() {
  "$cmake" -S "$source/tests/embed/host" -B "$folder/host" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@"
  "$cmake" --build "$folder/host" -j 2
}
case $way in
  subdirectory) build_host -DPALPATE_SOURCE="$source" ;;
  static) install_palpate && build_host -DCMAKE_PREFIX_PATH="$folder/prefix" ;;
  shared)
    install_palpate -DBUILD_SHARED_LIBS=ON && build_host -DCMAKE_PREFIX_PATH="$folder/prefix"
    library=$(find "$folder/prefix" -name 'libpalpate.so')
    # Only the C API is visible.
    if nm -D --defined-only "$library" | grep -v -E ' [TA] (palpate_|PALPATE_)'; then exit 1; fi
    ;;
  pkgconfig)
    install_palpate
    mkdir -p "$folder/host"
    PKG_CONFIG_PATH=$(dirname "$(find "$folder/prefix" -name palpate.pc)")
    export PKG_CONFIG_PATH
    # A C host with nothing of C++: the library needs no C++ runtime.
    cc -std=c11 -Wall -Wextra -Wpedantic -Werror "$source/tests/embed/example.c" -o "$folder/host/example_c" \
      $(pkg-config --cflags --libs --static palpate)
    c++ -std=c++17 -Wall -Wextra -Wpedantic -Werror "$source/tests/embed/example.cpp" -o "$folder/host/example_cpp" \
      $(pkg-config --cflags --libs --static palpate)
    ;;
esac
"$folder/host/example_c" "$folder/tiny.h5" > "$folder/c.txt"
"$folder/host/example_cpp" "$folder/tiny.h5" > "$folder/cpp.txt"
cat "$folder/c.txt" "$folder/cpp.txt"
grep -q "nodes drawn, flags 0" "$folder/c.txt"
# No contact above the surface, a force at the end that pushes the needle out.
grep -q "   0 ms   0.0000 N" "$folder/cpp.txt"
awk '/1000 ms/ { found = 1; if ($3 <= 0) exit 1 } END { exit !found }' "$folder/cpp.txt"
if "$folder/host/example_c" "$folder/absent.h5"; then exit 1; else test $? -eq 2; fi
