#!/bin/sh
# install_programs.sh BUILD FOLDER CMAKE PYTHON BUNDLE: installs everything from BUILD, moves the installation, runs each program with
# --version, and runs the Python example if BUILD has the package.
set -eu
build=$1 folder=$2 cmake=$3 python=$4 bundle=$5
here=$(dirname "$(realpath "$0")")
rm -rf "$folder"
"$cmake" --install "$build" --prefix "$folder/first" > "$folder.txt"
mv "$folder/first" "$folder/prefix"
for program in surface tetrahedra precompute bundle run organ feel draw igtl fit; do
  "$folder/prefix/bin/palpate-$program" --version
done
test -s "$folder/prefix/include/palpate/palpate.h"
test -s "$folder/prefix/share/doc/palpate/LICENSE"
package=$(find "$folder/prefix" -path '*/site-packages/palpate')
if test -e "$build/python"; then
  PYTHONPATH=$(dirname "$package") "$python" "$here/example.py" "$bundle"
fi
