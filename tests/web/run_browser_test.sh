#!/bin/sh
# run_browser_test.sh TEST NODE SOURCE VIEWER PALPATE_RUN WRITE_TINY_BUNDLE FOLDER: TEST, a file of this folder, on the box of
# tests/support. 77, which ctest counts as skipped, where the page is not built.
set -eu
test=$1 node=$2 source=$3 viewer=$4 palpate_run=$5 write_tiny_bundle=$6 folder=$7
if ! [ -f "$viewer/index.html" ]; then
  echo "$viewer: the page is not built; make -f Makefile.data test builds it"
  exit 77
fi
mkdir -p "$folder"
"$write_tiny_bundle" "$folder/box.h5"
PALPATE_VIEWER=$viewer PALPATE_PACKAGE=$(dirname "$viewer")/npm WRITE_TINY_BUNDLE=$write_tiny_bundle exec "$node" "$source/tests/web/$test" "$source/bindings/web" "$palpate_run" "$folder/box.h5" "$folder" box
