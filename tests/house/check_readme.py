"""The programs that READMEs show are the ones that tests/embed compiles and runs, and every link leads somewhere."""
import pathlib
import re
import subprocess
import sys

root = pathlib.Path(sys.argv[1])
failures = []

for page, language, example in (
    ("docs/embedding.md", "c", "tests/embed/example.c"),
    ("docs/embedding.md", "cpp", "tests/embed/example.cpp"),
    ("docs/embedding.md", "c", "tests/embed/two_loops.c"),
    ("docs/embedding.md", "c", "tests/embed/frames.h"),
    ("bindings/python/README.md", "python", "tests/embed/example.py"),
):
    blocks = re.findall(rf"```{language}\n(.*?)```", (root / page).read_text(), re.S)
    if (root / example).read_text() not in blocks:
        failures.append(f"{page}: no ```{language} block equals {example}; copy the file's text into it")

# Of the first example the README shows a part.
for part in re.findall(r"```c\n(.*?)```", (root / "README.md").read_text(), re.S):
    if part not in (root / "tests/embed/example.c").read_text():
        failures.append("README.md: a ```c block is no part of tests/embed/example.c; copy the file's lines into it")

tracked = subprocess.run(["git", "-C", root, "ls-files", "*.md"], check=True, capture_output=True, text=True).stdout.split()
for name in tracked:
    page = root / name
    text = page.read_text()
    for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text) + re.findall(r'<img src="([^"]+)"', text):
        if not (page.parent / target).exists():
            failures.append(f"{name}: link to {target}, which does not exist")

print("\n".join(failures))
sys.exit(1 if failures else 0)
