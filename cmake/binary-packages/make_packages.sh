#!/bin/bash
# make_packages.sh SOURCE BUILD WEB OUT JOBS: Debian packages of the programs, of the runtime and of its headers, a Python wheel, an npm
# package and a package for Unity, in OUT. BUILD: a folder of its own, for the shared library. WEB: the folder of {simd,baseline}/palpate.wasm.
# CMAKE_FLAGS in the environment: more options for CMake, as of the Makefile.
set -euo pipefail
source=$1 build=$2 web=$3 out=$4 jobs=$5
read -ra flags <<< "${CMAKE_FLAGS-}"
rm -rf "$out"
mkdir -p "$out"

cmake --preset release -S "$source" -B "$build" -DBUILD_SHARED_LIBS=ON -DPALPATE_BUILD_TESTS=OFF -DPALPATE_BUILD_PYTHON=OFF \
  -DPALPATE_BUILD_WEB=OFF -DCMAKE_INSTALL_PREFIX=/usr "${flags[@]}"
cmake --build "$build" -j "$jobs"
(cd "$build" && cpack -G DEB -B "$out" > cpack.log)
rm -rf "$out/_CPack_Packages"

(cd "$source/bindings/python" && /usr/bin/python3 -c "import build_backend; build_backend.build_wheel('$out')" > "$build/wheel.log")

package=$build/npm
"$source/bindings/web/make_npm_package.sh" "$source" "$web" "$package"
(cd "$package" && npm pack --silent --pack-destination "$out")

# For Unity: the same library, stripped, and the one for Windows.
cmake --preset windows -S "$source" -B "$build/windows" "${flags[@]}"
cmake --build "$build/windows" -j "$jobs"
for platform in . windows; do
  cmake --install "$build/$platform" --component runtime --strip --prefix "$build/unity/$platform" > /dev/null
done
/usr/bin/python3 "$source/bindings/csharp/make_package.py" "$source" "$build/unity" "$(find "$build/unity" -name 'libpalpate.so.?')" \
  "$(find "$build/unity/windows" -name 'libpalpate-?.dll')"
mv "$build"/unity/*.tgz "$out"
ls -l "$out"
