#!/bin/sh
# leaves_nothing.sh FOLDER COMMAND...: runs the command with an empty FOLDER for the files of its tests. Fails where the command does, and where
# it passes and leaves files there.
folder=$1
shift
rm -rf "$folder" && mkdir -p "$folder" || exit
TEST_TMPDIR=$folder "$@" || exit
left=$(ls -A "$folder")
if [ -n "$left" ]; then
  echo "files that passing tests have left in $folder:" $left
  exit 1
fi
rmdir "$folder"
