#!/usr/bin/env python3
"""No function of the runtime is longer, and no class has more data members, than one reads at once; none is pure. Usage: check_sizes.py SOURCES [TEST ...]"""
import pathlib
import re
import sys
import unittest

MOST_LINES, MOST_MEMBERS = 60, 25
NO_MEMBER = re.compile(r"(using|friend|static|class|struct|enum|template|typedef)\b")


def functions(text):
    """(line number, lines) of each function's body: of those that begin at a line's begin, and of those in a class, two spaces on."""
    outer = inner = (0, "")
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"[A-Za-z_~]", line):
            outer = (number, line)
        elif re.match(r"  [A-Za-z_~]", line):
            inner = (number, line)
        elif line in ("}", "  }"):
            in_class = re.match(r"(class|struct)\b", outer[1])
            begin, first = inner if line == "  }" else outer
            if "(" in first and (line == "}" or in_class):
                yield begin, number - begin - 1


def classes(text):
    """(name, data members) of each class, nested ones for themselves."""
    text = re.sub(r"//.*", "", text)
    for found in re.finditer(r"\b(?:class|struct)\s+(\w+)[^;{()]*\{", text):
        depth, body, at = 1, "", found.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[at], 0)
            body += text[at] if depth == 1 and text[at] not in "{}" else ";" if text[at] == "}" and depth == 1 else ""
            at += 1
        members = 0
        for statement in body.split(";"):
            statement = re.sub(r"\b(public|private|protected)\s*:", "", statement).strip()
            while "<" in statement and (shorter := re.sub(r"<[^<>]*>", "", statement)) != statement:
                statement = shorter
            if len(statement.split()) > 1 and "(" not in statement and not NO_MEMBER.match(statement):
                members += statement.count(",") + 1
        yield found.group(1), members


class Sizes(unittest.TestCase):
    def sources(self):
        return [file for file in sorted((ROOT / "runtime").rglob("*.[hc]*")) if "include" not in file.parts]

    def hold(self, parts, most, fewest):
        """parts(text) yields (name or line, size): each size is at most `most`, and there are more than `fewest` parts in all."""
        seen = 0
        for file in self.sources():
            for name, size in parts(file.read_text()):
                seen += 1
                with self.subTest(f"{file.relative_to(ROOT)}: {name}"):
                    self.assertLessEqual(size, most, "split it")
        self.assertGreater(seen, fewest)

    def test_functions_are_short(self):
        self.hold(functions, MOST_LINES, 1000)

    def test_classes_are_small(self):
        self.hold(classes, MOST_MEMBERS, 200)

    def test_no_function_is_pure(self):
        """A library without the C++ runtime, and a page's module without WASI, has nothing that a pure function could call."""
        for file in self.sources():
            with self.subTest(f"{file.relative_to(ROOT)}"):
                self.assertNotRegex(file.read_text(), r"virtual [^;{]*= 0;")

    def test_they_are_counted(self):
        text = "int f(int a) {\n" + "  ++a;\n" * 61 + "}\n"
        self.assertEqual(list(functions(text)), [(1, 61)])
        text = "class A {\n int f(int) const { int x; return x; }\n  static int s;\n  std::map<int, int> a_, b_[3] = {}; // c\n  double* c_;\n};\n"
        self.assertEqual(list(classes(text)), [("A", 3)])


if __name__ == "__main__":
    ROOT = pathlib.Path(sys.argv.pop(1))
    unittest.main(verbosity=2)
