"""A program that names no effect links none. Usage: check_linked_effects.py LIST PROGRAM WHOLE SCRATCH
LIST: runtime/complete/effects.cpp. PROGRAM: scene_without_effects, which is run with the file SCRATCH. WHOLE: a program with all effects."""
import pathlib
import re
import subprocess
import sys

effects, program, whole, scratch = sys.argv[1:]
names = re.findall(r"&(\w+_effect)\b", pathlib.Path(effects).read_text())
if len(names) < 12:
    sys.exit(f"{effects}: expected the list of all effects, found {names}")


def linked(file):
    symbols = subprocess.run(["nm", "--demangle", file], check=True, capture_output=True, text=True).stdout
    return [name for name in names if re.search(rf"\bpalpate::{name}\b", symbols)]


if linked(whole) != names:
    sys.exit(f"{whole}: expected all of {names}, found {linked(whole)}")
if linked(program):
    sys.exit(f"{program}: names no effect; expected none of them, found {linked(program)}: something of the core names these")
sys.exit(subprocess.run([program, scratch]).returncode)
