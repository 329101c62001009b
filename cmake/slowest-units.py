#!/usr/bin/env python3
"""The slowest units of a build folder: cmake/slowest-units.py BUILD [COUNT].

Reads the times that ninja noted when it last built each object (wall-clock seconds; a unit that ccache answered counts with
the time of the answer: build with CCACHE_DISABLE=1 on a quiet machine)."""
import pathlib
import sys

build = pathlib.Path(sys.argv[1])
count = int(sys.argv[2]) if len(sys.argv) > 2 else 10
seconds = {}
for line in (build / ".ninja_log").read_text().splitlines()[1:]:
    start, end, _, output, _ = line.split("\t")
    if output.endswith((".o", ".gch")):
        seconds[output] = (int(end) - int(start)) / 1000
print("| seconds | unit |\n|---|---|")
for output in sorted(seconds, key=seconds.get, reverse=True)[:count]:
    folder, _, source = output.partition("CMakeFiles/")
    print(f"| {seconds[output]:.1f} | `{folder}{source.partition('.dir/')[2].removesuffix('.o')}` |")
print(f"\n{len(seconds)} units, {sum(seconds.values()):.0f} s in all")
