#!/bin/sh
# compare_recorded_run.sh NATIVE RUN PROGRAM FOLDER: plays each bundle of FOLDER (write_recorded_run) with this machine's recorded_run
# and with that of another platform. Both must print the same hashes.
set -eu
native=$1 run=$2 program=$3 folder=$4
output=$(mktemp -d)
trap 'rm -r "$output"' EXIT
played=0
for bundle in "$folder"/*.h5; do
  path=$folder/short-path
  if test "$(basename "$bundle")" = "f32 rows.h5"; then path=$folder/path; fi
  "$native" "$bundle" "$path" 2 > "$output/expected"
  "$run" "$program" "$bundle" "$path" 2 > "$output/found"
  if ! diff "$output/expected" "$output/found"; then
    echo "$bundle: the hashes of this machine (<) and of the other platform (>) differ"
    exit 1
  fi
  test "$(wc -l < "$output/found")" -eq 38  # scenes
  played=$((played + 1))
done
echo "$played bundles, the same hashes"
test "$played" -eq 5
