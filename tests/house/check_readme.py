"""The programs that README shows are the ones that tests/embed compiles and runs, and every link leads somewhere."""
import pathlib
import re
import subprocess
import sys

root = pathlib.Path(sys.argv[1])
failures = []

readme = (root / "README.md").read_text()
for language, example in (("c", "tests/embed/example.c"), ("cpp", "tests/embed/example.cpp")):
    blocks = re.findall(rf"```{language}\n(.*?)```", readme, re.S)
    if (root / example).read_text() not in blocks:
        failures.append(f"README.md: no ```{language} block equals {example}; copy the file's text into it")

tracked = subprocess.run(["git", "-C", root, "ls-files", "*.md"], check=True, capture_output=True, text=True).stdout.split()
for name in tracked:
    page = root / name
    for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text()):
        if not (page.parent / target).exists():
            failures.append(f"{name}: link to {target}, which does not exist")

print("\n".join(failures))
sys.exit(1 if failures else 0)
