"""The programs that READMEs show are the ones that tests/embed compiles and runs, and every link leads somewhere."""
import pathlib
import re
import subprocess
import sys

root = pathlib.Path(sys.argv[1])
failures = []

for page, language, example in (
    ("README.md", "c", "tests/embed/example.c"),
    ("README.md", "cpp", "tests/embed/example.cpp"),
    ("bindings/python/README.md", "python", "tests/embed/example.py"),
):
    blocks = re.findall(rf"```{language}\n(.*?)```", (root / page).read_text(), re.S)
    if (root / example).read_text() not in blocks:
        failures.append(f"{page}: no ```{language} block equals {example}; copy the file's text into it")

tracked = subprocess.run(["git", "-C", root, "ls-files", "*.md"], check=True, capture_output=True, text=True).stdout.split()
for name in tracked:
    page = root / name
    for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text()):
        if not (page.parent / target).exists():
            failures.append(f"{name}: link to {target}, which does not exist")

print("\n".join(failures))
sys.exit(1 if failures else 0)
