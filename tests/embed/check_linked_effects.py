"""check_linked_effects.py LIST BUNDLE MOST_KB PROGRAM=EFFECT,EFFECT... PROGRAM=...: each program links the effects that it names and no other one, and all of
them print the same force on the bundle. PROGRAM=all: all effects. LIST: runtime/complete/effects.cpp. The first program has, stripped, at most
MOST_KB kB."""
import pathlib
import re
import subprocess
import sys
import tempfile

effects, bundle, most_kb, *programs = sys.argv[1:]
names = re.findall(r"&(\w+)_effect\b", pathlib.Path(effects).read_text())
if len(names) < 12:
    sys.exit(f"{effects}: expected the list of all effects, found {names}")


def linked(file):
    symbols = subprocess.run(["nm", "--demangle", file], check=True, capture_output=True, text=True).stdout
    return [name for name in names if re.search(rf"\bpalpate::{name}_effect\b", symbols)]


def stripped_kb(file):
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder, "program")
        subprocess.run(["strip", "-o", copy, file], check=True)
        return copy.stat().st_size / 1000


wrong, forces = [], {}
for number, (program, wanted) in enumerate(argument.split("=") for argument in programs):
    expected = names if wanted == "all" else [name for name in names if name in wanted.split(",")]
    if linked(program) != expected:
        wrong.append(f"{program} names {expected}, and links {linked(program)}: something of the core names the others")
    forces[program] = subprocess.run([program, bundle], capture_output=True, text=True).stdout
    print(f"{program}: {stripped_kb(program):.0f} kB stripped, {forces[program].strip()}", flush=True)
    if number == 0 and stripped_kb(program) > float(most_kb):
        wrong.append(f"{program} has {stripped_kb(program):.0f} kB; expected at most {most_kb}")
if len(set(forces.values())) != 1 or not re.match(r"[0-9.]+ N, flags 0\n$", next(iter(forces.values()))):
    wrong.append(f"the forces differ: {forces}")
sys.exit("\n".join(wrong) or 0)
