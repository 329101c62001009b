#!/bin/sh
# small_core.sh SOURCE FOLDER BUNDLE CORE_HOST MOST_KB CMAKE: the core alone, built to be small (preset "small"), gives a host in C at most MOST_KB kB
# stripped, and what CORE_HOST prints, the same host with the core that is built to be quick.
set -eu
source=$1 folder=$2 bundle=$3 core_host=$4 most=$5 cmake=$6
"$cmake" --preset small -S "$source" -B "$folder"
"$cmake" --build "$folder" --target palpate_core -j 2
${CC:-cc} "$source/tests/embed/chosen_effects.c" -I "$source/runtime/include" "$folder/runtime/libpalpate_core.a" -Wl,--gc-sections -lm -s -o "$folder/host"
kb=$(($(wc -c < "$folder/host") / 1000))
echo "$kb kB stripped"
test "$kb" -le "$most"
"$folder/host" "$bundle" > "$folder/host.txt"
"$core_host" "$bundle" | diff - "$folder/host.txt"
