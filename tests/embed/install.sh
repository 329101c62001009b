#!/bin/sh
# install.sh FROM FOLDER CMAKE [OPTION...]: installs only the runtime, then moves the installation to FOLDER/prefix. FROM: the sources, which
# it builds with OPTION..., or a build folder.
set -eu
from=$1 folder=$2 cmake=$3
shift 3
rm -rf "$folder"
build=$from source=
if ! test -e "$from/CMakeCache.txt"; then
  source=$from build=$folder/build
  "$cmake" -S "$source" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$folder/first" \
    -DPALPATE_BUILD_OFFLINE=OFF -DPALPATE_BUILD_TESTS=OFF "$@"
  "$cmake" --build "$build" -j 2
fi
for component in runtime development; do
  "$cmake" --install "$build" --component $component --prefix "$folder/first"
done
mv "$folder/first" "$folder/prefix"

# The runtime needs only a compiler: every header that it reads is ours, the compiler's or libc's. (clang also lists tbb.h, because
# the standard library asks whether it exists.)
if test -n "$source"; then
(cd "$folder/build" && ninja -t deps | sed -n 's/^    //p' | sort -u | xargs realpath) > "$folder/headers.txt"
grep -q "/runtime/include/palpate/palpate.h$" "$folder/headers.txt"
if grep -v -E "^($source|$(realpath "$build"))/(runtime|formats)/|^/usr/lib/(gcc|gcc-cross|llvm)|^/usr/(aarch64-linux-gnu|share/mingw-w64)/include/|^/usr/include/([a-z0-9_]+-linux-gnu/)?(c\+\+|bits|sys|gnu|asm|asm-generic|linux)/|^/usr/include/[a-z0-9-]+\.h$|^/usr/include/tbb/tbb\.h$" "$folder/headers.txt"; then
  echo "those headers belong to no compiler"
  exit 1
fi
fi

# All files that a host needs are there, and none contains the path of the first installation.
cd "$folder/prefix"
for file in include/palpate/palpate.h include/palpate/palpate.hpp include/palpate/palpate_complete.h share/doc/palpate/LICENSE; do
  test -s "$file"
done
for name in 'libpalpate.*' palpate-config.cmake palpate-config-version.cmake palpate.pc; do
  find . -name "$name" | grep -q .
done
if grep -r -F "$folder/first" .; then exit 1; fi
