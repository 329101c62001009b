#!/bin/sh
# install_programs.sh BUILD FOLDER CMAKE: installs what BUILD has built, moves it, and asks each program for its version.
set -eu
build=$1 folder=$2 cmake=$3
rm -rf "$folder"
"$cmake" --install "$build" --prefix "$folder/first" > "$folder.txt"
mv "$folder/first" "$folder/prefix"
for program in surface tetrahedra precompute bundle run feel draw; do
  "$folder/prefix/bin/palpate-$program" --version
done
test -s "$folder/prefix/include/palpate/palpate.h"
test -s "$folder/prefix/share/doc/palpate/LICENSE"
