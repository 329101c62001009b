"""run_page.py PAGE FOLDER PROGRAMS: does what a page tells the reader to do, word by word, in an empty folder, FOLDER/work.

The page's code blocks, in order:
  ```toml, ```make, ```csv  the first line, "# NAME", names the file that the reader writes
  ```sh             commands of one bash, which stops where one fails
  ```text           what the reader sees: shown, not run
A comment line in front of a block, which the reader does not see, says more about it:
  <!-- not run: WHY -->      the block is left out
  <!-- ends with N -->       the block's last command ends with that exit code
  <!-- prints -->            each line of the ```text block is in what the block before it printed
For the commands PALPATE is a repository that they may write to, in which build/bin is PROGRAMS; build/bin stands first on the
PATH."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"(?:^<!-- ([^\n]*?) -->\n)?^```(\w*)\n(.*?)^```$", re.S | re.M)


def blocks(text):
    """(remark, language, content) of each block."""
    return [(remark or "", language, content) for remark, language, content in BLOCK.findall(text)]


def run(content, folder, environment, exit_code):
    shell = subprocess.run(["bash", "-e", "-u", "-o", "pipefail", "-c", content], cwd=folder, env=environment,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if shell.returncode != exit_code:
        sys.exit("expected exit code %d, found %d, from\n%s\nwhich printed\n%s"
                 % (exit_code, shell.returncode, content, shell.stdout))
    return shell.stdout


def follow(page, folder, environment):
    printed = ""
    for remark, language, content in blocks(page.read_text()):
        if remark.startswith("not run:"):
            continue
        if language in ("toml", "make", "csv"):
            name = re.match(r"# (\S+?):?(?: .*)?\n", content)
            if not name:
                sys.exit("%s: the first line of a %s block names its file; found\n%s" % (page, language, content))
            file = folder / name[1]
            if not file.parent.is_dir():
                sys.exit("%s: nothing made the folder of %s" % (page, name[1]))
            file.write_text(content)
        elif language == "sh":
            ends = re.fullmatch(r"ends with (\d+)", remark)
            printed = run(content, folder, environment, int(ends[1]) if ends else 0)
        elif remark == "prints":
            for line in content.splitlines():
                if line.strip() not in printed:
                    sys.exit("%s: expected the line\n%s\nfound\n%s" % (page, line, printed))


def repository_to_write_to(folder, programs):
    """Links to the real one, but for pipelines, which is a copy, and build."""
    folder.mkdir(parents=True)
    for entry in ROOT.iterdir():
        if entry.name == "pipelines":
            shutil.copytree(entry, folder / entry.name)
        elif not entry.name.startswith("build") and entry.name not in ("data", ".git"):
            (folder / entry.name).symlink_to(entry)
    (folder / "build").mkdir()
    (folder / "build/bin").symlink_to(programs)
    return folder


def main():
    page, folder, programs = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    shutil.rmtree(folder, ignore_errors=True)
    repository = repository_to_write_to(folder.resolve() / "repository", programs.resolve())
    work = folder.resolve() / "work"
    work.mkdir()
    environment = dict(os.environ, PALPATE=str(repository), PYTHON="/usr/bin/python3",
                       PATH="%s/build/bin%s%s" % (repository, os.pathsep, os.environ["PATH"]))
    follow(page, work, environment)


if __name__ == "__main__":
    main()
