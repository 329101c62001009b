#!/bin/sh
# wine_folder.sh start|end RUN FOLDER SERVER: makes the wine folder of the tests anew, or ends wine in it and removes it.
set -eu
what=$1 run=$2 folder=$3 server=$4
if test -d "$folder"; then
  WINEPREFIX=$folder "$server" -k || true  # it may have ended by itself
  rm -rf "$folder"
fi
if test "$what" = start; then
  mkdir -p "$folder"
  # The server stays for 15 minutes after the last program: one that ends while the next program starts would fail that program.
  WINEPREFIX=$folder WINEDEBUG=-all "$server" --persistent=900 > /dev/null 2>&1 < /dev/null
  "$run" wineboot --init
  test -d "$folder/drive_c/windows"
fi
