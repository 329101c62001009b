#!/bin/bash
# install.sh: what both recipes of this folder run inside a new Debian 12, as root: installs the packages of cmake/packages/organ.txt, builds
# the programs and the runtime, and installs them in /usr/local. The sources stay, so that the pipelines run there too. CMAKE_FLAGS in the
# environment: more options for CMake, as of the Makefile.
set -euo pipefail
read -ra flags <<< "${CMAKE_FLAGS-}"
source=$(realpath "$(dirname "$0")/../..")
"$source/cmake/install-packages.sh" "$source/cmake/packages/organ.txt"
build=$source/build-container  # beside the sources, as in every clone, so that a compiler's cache answers
cmake --preset release -S "$source" -B "$build" -DPALPATE_BUILD_TESTS=OFF -DPALPATE_BUILD_PYTHON=OFF -DPALPATE_BUILD_WEB=OFF \
  -DCMAKE_INSTALL_PREFIX=/usr/local "${flags[@]}"
cmake --build "$build"
cmake --install "$build" --strip > /dev/null
rm -rf "$build"
ldconfig
apt-get clean
palpate-run --version
