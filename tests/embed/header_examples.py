"""header_examples.py INCLUDE_FOLDER COMPILER: the example at the top of each public header compiles as C, with that header alone. A header has at
most 150 lines; MOST_LINES names those that have more."""
import pathlib
import re
import subprocess
import sys
import tempfile

MOST_LINES = {"palpate.h": 500, "palpate_bundle.h": 200}
WITHOUT_EXAMPLE = ("palpate_complete.h", "palpate_device.h", "palpate_mailbox.h", "palpate_passivity.h",
                   "palpate_watchdog.h")  # two threads: tests/embed/device_loop.c, two_loops.c
# What the examples leave to the host.
LIBC = """
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
"""
AROUND = """
extern palpate_bundle *bundle, *liver, *kidney;
extern palpate_scene* scene;
extern palpate_tool tools[1];
extern int32_t tool_count, vertex_count, triangle_count, runs, impacts;
extern double dt, eye[3], direction[3], point[3], distance, pressure, depth[10], position[3], orientation[4];
extern uint64_t mapped_bytes;
extern float *positions, *drawn;
extern int32_t* triangles;
extern palpate_contacts* contacts;
extern size_t contacts_bytes, world_bytes;
extern palpate_error error;
extern palpate_shape_out shape;
void sleep_a_millisecond(void);
"""
OF_WORLD = "extern palpate_world* world;\n"
OF_WORLD_CONTACTS = "extern palpate_world_contacts* world_contacts;\n"
OF_PAIR = "extern palpate_world_organ organs[2];\n"
OF_SHAPE = "extern palpate_tool_shape* instrument;\nextern palpate_tool tool;\n"


def example_of(text):
    """The lines that follow one another behind ' *     ' in the first comment: those with a whole program, or the first ones."""
    runs = re.findall(r"(?:^ \*     .*\n)+", text[: text.index("*/")], re.M)
    runs = [run for run in runs if "int main" in run] or runs[:1]
    return re.sub(r"^ \*     ", "", runs[0], flags=re.M) if runs else ""


def program_of(name, text):
    example = example_of(text)
    program = f"#include <palpate/{name}>\n" + LIBC
    if name != "palpate_bundle.h":
        program += AROUND
    if name.startswith("palpate_world"):
        program += OF_WORLD_CONTACTS + ("" if name == "palpate_world_contacts.h" else OF_WORLD)
    code = re.sub(r"//.*", "", example)
    if "organs" in code and "organs[2] =" not in code:
        program += OF_PAIR
    if name == "palpate_tool_shape.h":
        program += OF_SHAPE
    return program + (example if "int main" in example else "void example(void);\nvoid example(void) {\n" + example + "}")


def main():
    include, compiler = pathlib.Path(sys.argv[1]), sys.argv[2]
    wrong = []
    for header in sorted((include / "palpate").glob("*.h")):
        text = header.read_text()
        lines = len(text.splitlines())
        if lines > MOST_LINES.get(header.name, 150):
            wrong.append(f"{header.name} has {lines} lines; expected at most {MOST_LINES.get(header.name, 150)}")
        if header.name in WITHOUT_EXAMPLE:
            continue
        if not example_of(text):
            wrong.append(f"{header.name} begins without an example: lines of its first comment behind ' *     '")
            continue
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder, "example.c")
            source.write_text(program_of(header.name, text))
            warnings = ["-Wall", "-Werror", "-Wno-unused-variable", "-Wno-unused-but-set-variable"]
            made = subprocess.run([compiler, "-std=c11", *warnings, "-fsyntax-only", f"-I{include}", source], capture_output=True, text=True)
            if made.returncode:
                wrong.append(f"{header.name}: its example does not compile\n{made.stderr}")
    print("\n".join(wrong))
    return 3 if wrong else 0


sys.exit(main())
