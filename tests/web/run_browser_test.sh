#!/bin/sh
# run_browser_test.sh NODE SOURCE VIEWER PALPATE_RUN WRITE_TINY_BUNDLE FOLDER: browser_test.mjs on the box of tests/support. 77,
# which ctest counts as skipped, where the page is not built.
set -eu
node=$1 source=$2 viewer=$3 palpate_run=$4 write_tiny_bundle=$5 folder=$6
if ! [ -f "$viewer/index.html" ]; then
  echo "$viewer: the page is not built; make -f Makefile.data test builds it"
  exit 77
fi
mkdir -p "$folder"
"$write_tiny_bundle" "$folder/box.h5"
PALPATE_VIEWER=$viewer exec "$node" "$source/tests/web/browser_test.mjs" "$source/bindings/web" "$palpate_run" "$folder/box.h5" "$folder" box
