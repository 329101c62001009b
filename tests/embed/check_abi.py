"""check_abi.py INCLUDE_FOLDER LIST COMPILER [--write | --run LAUNCHER]: the public C headers say what LIST says, function by function, field by
field, value by value. Sizes and offsets are the compiler's, on 64-bit systems. --write writes LIST anew; runtime/ABI.md says when.
--run: what runs the compiler's programs, where the compiler is for another platform."""
import pathlib
import re
import subprocess
import sys
import tempfile

HEADERS = sorted(header.name for header in (pathlib.Path(sys.argv[1]) / "palpate").glob("*.h") if header.name != "palpate_complete.h")


def without_comments(text):
    return re.sub(r"/\*.*?\*/", " ", text, flags=re.S)


def one_line(text):
    return re.sub(r"\s+", " ", text).strip()


def fields_of(body):
    """(name, declaration) of every field; `int32_t a, b;` are two."""
    for declaration in filter(None, map(one_line, body.split(";"))):
        pointer_to_function = re.search(r"\(\*(\w+)\)", declaration)
        if pointer_to_function:
            yield pointer_to_function[1], declaration
            continue
        kind, first = re.match(r"(.*?[\s*])(\w+(?:\[\w+\])*(?:, \w+(?:\[\w+\])*)*)$", declaration).groups()
        for declarator in first.split(", "):
            yield declarator.split("[")[0], kind + declarator


def program_that_prints(text):
    """A C program that prints the list for a header without its comments."""
    functions = [one_line(f) for f in re.findall(r"^PALPATE_API (.*?);", text, re.S | re.M)]
    structs = re.findall(r"^typedef struct (\w+) \{(.*?)^\} \w+;", text, re.S | re.M)
    # Of an effect: palpate.h has the typedef.
    structs_of_effects = re.findall(r"^struct (\w+) \{(.*?)^\};", text, re.S | re.M)
    enums = re.findall(r"^(?:typedef )?enum\s*(\w*)\s*\{(.*?)\}", text, re.S | re.M)
    aliases = [one_line(t) for t in re.findall(r"^typedef (?!enum|struct \w+ \{)(.*?);", text, re.S | re.M)]
    macros = re.findall(r"^#define (PALPATE_\w+) (\d+)$", text, re.M)
    # Every typedef, enum and function of the header must be among them.
    assert text.count("PALPATE_API ") == len(functions) + text.count("define PALPATE_API "), "a function is not understood"
    assert text.count("typedef ") == len(structs) + len(aliases) + sum(1 for name, _ in enums if name), "a type is not understood"

    lines = [f'puts("function {f}");' for f in functions] + [f'puts("type {a}");' for a in aliases]
    lines += [f'printf("constant {name} %d\\n", {name});' for name, _ in macros]
    for name, body in enums:
        for value in re.findall(r"(\w+)(?:\s*=[^,]*)?(?:,|$)", one_line(body)):
            lines.append(f'printf("constant {value} %d{" of " + name if name else ""}\\n", (int){value});')
        if name:
            lines.append(f'printf("size {name} %zu\\n", sizeof({name}));')
    for name, body in structs + structs_of_effects:
        lines.append(f'printf("struct {name} %zu bytes\\n", sizeof({name}));')
        last = list(fields_of(body))[-1][0]
        lines.append(f"_Static_assert(sizeof({name}) == offsetof({name}, {last}) + sizeof((({name}*)0)->{last}), "
                     f'"{name} ends in padding, in which a later field would not change its size; add a field reserved");')
        for field, declaration in fields_of(body):
            size = f"sizeof((({name}*)0)->{field})"
            lines.append(f'printf("  %3zu +%-3zu {declaration}\\n", offsetof({name}, {field}), {size});')
    return "\n".join(lines)


def printed_list(include, compiler, launcher):
    includes = "".join(f"#include <palpate/{h}>\n" for h in HEADERS)
    body = "\n".join(program_that_prints(without_comments((include / "palpate" / h).read_text())) for h in HEADERS)
    with tempfile.TemporaryDirectory() as folder:
        source, program = pathlib.Path(folder, "list.c"), pathlib.Path(folder, "list.exe")
        source.write_text(f"#include <stddef.h>\n#include <stdio.h>\n{includes}int main(void) {{\n{body}\nreturn 0;\n}}\n")
        subprocess.run([compiler, "-std=c11", "-pedantic-errors", "-w", f"-I{include}", source, "-o", program], check=True)
        return subprocess.run([*launcher, program], check=True, capture_output=True, text=True).stdout


def main():
    include, committed, compiler = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    launcher = sys.argv[5:] if sys.argv[4:5] == ["--run"] else []
    found = printed_list(include, compiler, launcher)
    if sys.argv[4:] == ["--write"]:
        committed.write_text(found)
        return 0
    expected = committed.read_text()
    if found == expected:
        return 0
    gone = [line for line in expected.splitlines() if line not in found.splitlines()]
    come = [line for line in found.splitlines() if line not in expected.splitlines()]
    print("\n".join([f"- {line}" for line in gone] + [f"+ {line}" for line in come] or ["the order differs"]))
    print(f"the public headers are not those of {committed}; runtime/ABI.md says what may change and what to do then")
    return 3


sys.exit(main())
