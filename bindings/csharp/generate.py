"""generate.py ABI_LIST INCLUDE_FOLDER: writes Native.cs to the standard output: the whole C API for C#.

Functions, structs and constants come from runtime/abi_3.txt, which a test holds to the headers. The `static inline` functions are not in
the library; their C is turned into C#. A declaration that no rule here covers ends the program."""
import pathlib
import re
import sys

# size_t: the package has libraries for 64-bit systems alone, as the list has.
TYPES = {"void": "void", "char": "byte", "float": "float", "double": "double", "int32_t": "int", "int64_t": "long", "uint8_t": "byte",
         "uint32_t": "uint", "uint64_t": "ulong", "size_t": "ulong"}
KEYWORDS = {"event", "fixed", "in", "lock", "object", "out", "params", "ref"}
HEAD = """// Written by bindings/csharp/generate.py from {list} and the C headers, which say what each function does.
using System;
using System.Runtime.InteropServices;

namespace Palpate.Native {{
"""


class Api:
    """What the list says, by kind. A constant is (name, value, enum or '')."""

    def __init__(self, text):
        self.functions, self.aliases, self.constants, self.structs, fields = [], [], [], {}, None
        for line in text.splitlines():
            if line.startswith("  "):
                fields.append(re.fullmatch(r" +\d+ \+\d+ +(.*)", line)[1])
                continue
            kind, rest = line.split(" ", 1)
            if kind == "function":
                self.functions.append(re.fullmatch(r"(.*?)(\w+)\((.*)\)", rest).groups())
            elif kind == "type":
                self.aliases.append(rest)
            elif kind == "constant":
                name, value, *of = rest.split(" ")
                self.constants.append((name, int(value), of[1] if of else ""))
            elif kind == "struct":
                fields = self.structs[rest.split()[0]] = []
            elif kind != "size":
                sys.exit(f"not understood: {line}")
        self.opaque = [a.split()[-1] for a in self.aliases if a.startswith("struct ")]
        self.callbacks = [match.groups() for a in self.aliases if (match := re.fullmatch(r"void \(\*(\w+)\)\((.*)\)", a))]
        self.flags = [a.split()[-1] for a in self.aliases if a.startswith("uint32_t ")]
        if len(self.opaque) + len(self.callbacks) + len(self.flags) != len(self.aliases):
            sys.exit("a type is not understood")
        enums = {of for _, _, of in self.constants if of}
        self.names = {**TYPES, **{name: name for name in [*self.structs, *self.opaque, *self.flags, *enums]},
                      **{name: "IntPtr" for name, _ in self.callbacks}}
        self.numbers = {name: value for name, value, of in self.constants if not of}

    def type(self, c):
        """`const palpate_tool*` -> `palpate_tool*`."""
        base, stars = re.fullmatch(r"(\w+)\s*(\**)", re.sub(r"\b(const|struct) ", "", c).replace(" *", "*").strip()).groups()
        return self.names[base] + stars

    def parameters(self, text):
        if text == "void":
            return ""
        out = []
        for parameter in text.split(", "):
            kind, name, array = re.fullmatch(r"(.*?)(\w+)(\[\d+\])?", parameter).groups()
            out.append(f"{self.type(kind)}{'*' if array else ''} {safe(name)}")
        return ", ".join(out)

    def fields(self, declaration):
        """The C# fields of one of C: an array of numbers is `fixed`, one of structs is a field for each element."""
        if pointer := re.search(r"\(\*(\w+)\)", declaration):
            return [f"public IntPtr {pointer[1]};"]
        kind, name, sizes = re.fullmatch(r"(.*?)(\w+)((?:\[\w+\])*)", declaration).groups()
        kind, count = self.type(kind), 1
        for size in re.findall(r"\[(\w+)\]", sizes):
            count *= int(size) if size.isdigit() else self.numbers[size]
        if not sizes:
            return [f"public {kind} {safe(name)};"]
        if kind in TYPES.values():
            return [f"public fixed {kind} {name}[{count}];"]
        return [f"public {kind} {name}_{k};" for k in range(count)]

    def enum(self, name):
        """Members without what all names of the enum begin with: palpate_contact_model.PATCH. Flags have no enum in C."""
        start = name.replace("_flags", "_").upper()
        members = [(n, v) for n, v, of in self.constants if of == name or (not of and name in self.flags and n.startswith(start))]
        common = len(start) if name in self.flags else len(prefix_of([n for n, _ in members]))
        return [(member[common:], value) for member, value in members]


def prefix_of(names):
    words = [name.split("_") for name in names]
    same = 0
    while all(len(w) > same + 1 and w[same] == words[0][same] for w in words):
        same += 1
    return "_".join(words[0][:same]) + "_"


def safe(name):
    return "@" + name if name in KEYWORDS else name


def inline_functions(api, include):
    """C# of each `static inline` function of the headers."""
    text = "\n".join(re.sub(r"/\*.*?\*/", " ", header.read_text(), flags=re.S) for header in sorted(include.glob("palpate/*.h")))
    for returned, name, parameters, body in re.findall(r"^static inline (.*?)(\w+)\(([^{]*?)\) \{\n(.*?)^\}", text, re.S | re.M):
        body = re.sub(r"\s+", " ", re.sub(r"\b(const|struct) ", "", body)).strip()
        for variable in re.findall(r"sizeof (\w+)", body):
            kind = re.search(rf"\b(\w+) {variable};", body)[1]
            body = body.replace(f"sizeof {variable}", f"(ulong)sizeof({kind})")
        body = re.sub(r"\((\w+)(\**)\)", lambda cast: f"({api.names.get(cast[1], cast[1])}{cast[2]})", body)
        body = re.sub(r"return (contacts->\w+) \?", r"return \1 != 0 ?", body).replace("NULL", "null")
        body = re.sub(rf"(?<![\w>])({'|'.join(KEYWORDS)})\b", r"@\1", body)
        parameters = re.sub(r"\s+", " ", parameters)
        yield f"    public static {api.type(returned)} {name}({api.parameters(parameters)}) {{ {body} }}"


def main():
    api = Api(pathlib.Path(sys.argv[1]).read_text())
    lines = [HEAD.format(list=pathlib.Path(sys.argv[1]).name)]
    lines += [f"  public struct {name} {{ }}" for name in api.opaque]
    lines += [f"  [UnmanagedFunctionPointer(CallingConvention.Cdecl)]\n  public unsafe delegate void {name}({api.parameters(parameters)});"
              for name, parameters in api.callbacks]
    for name in [*api.flags, *dict.fromkeys(of for _, _, of in api.constants if of)]:
        flags = name in api.flags
        lines.append(f"  {'[Flags] ' if flags else ''}public enum {name} : {'uint' if flags else 'int'} {{")
        lines += [f"    {member} = {value}," for member, value in api.enum(name)] + ["  }"]
    for name, declarations in api.structs.items():
        lines.append(f"  [StructLayout(LayoutKind.Sequential)]\n  public unsafe struct {name} {{")
        lines += [f"    {field}" for declaration in declarations for field in api.fields(declaration)] + ["  }"]
    lines.append('  public static unsafe class Api {\n    const string Library = "palpate";')
    starts = tuple(name.replace("_flags", "_").upper() for name in api.flags)
    lines += [f"    public const int {n} = {value};" for n, value in api.numbers.items() if not n.startswith(starts)]
    for returned, name, parameters in api.functions:
        lines.append("    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]")
        lines.append(f"    public static extern {api.type(returned)} {name}({api.parameters(parameters)});")
    lines += inline_functions(api, pathlib.Path(sys.argv[2]))
    print("\n".join(lines + ["  }\n}"]))


main()
