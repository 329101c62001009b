"""Removes each guard of guards.toml from a copy of the sources, one at a time, and checks that the cases named there fail.

    guards.py SOURCE BUILD -o FOLDER [--only NAME] [--cmake OPTIONS]    the whole run; SOURCE is not changed, the copy is in BUILD
    guards.py SOURCE --check                                            only checks that the list fits the sources
"""
import argparse
import json
import os
import pathlib
import re
import resource
import shlex
import signal
import subprocess
import sys
import time
import tomllib

FOLDERS = ("bench", "bindings", "cmake", "formats", "meshing", "pipelines", "precompute", "programs", "runtime", "studies", "tests")
FILES = ("CMakeLists.txt", "CMakePresets.json", "LICENSE")
TIME_LIMIT = 180  # s for a case; none takes a tenth of it
MEMORY_LIMIT = 8 << 30  # bytes for a case: without some guards a case would use all memory


# ---- the list, and the sources that it must fit ---------------------------------------------------------------------

def read(source):
    """The guards of the list, one dictionary each."""
    listed = tomllib.loads((source / "tests/stability/guards.toml").read_text())
    for group, files in listed.items():
        for file, guards in files.items():
            for name, guard in guards.items():
                find, replace = guard.pop("find", ""), guard.pop("replace", "")
                if not find or len(guard) != 1:
                    sys.exit(f"{name}: expected the key find and one test program, found {', '.join(['find'] * bool(find) + [*guard])}")
                (program, cases), = guard.items()
                yield {"name": name, "group": group, "file": file, "find": find, "replace": replace, "program": program, "cases": cases}

def cases_of_programs(source):
    """Test program -> the cases in its folder and those inside, as the sources spell them."""
    programs = {}
    for lists in (source / "tests").rglob("CMakeLists.txt"):
        cases = set()
        for file in lists.parent.rglob("*.cpp"):
            cases.update(f"{suite}.{name}" for suite, name in re.findall(r"^TEST(?:_F)?\((\w+), (\w+)\)", file.read_text(), re.M))
        programs.update((name, cases) for name in re.findall(r"^\s*palpate_test\((\w+)", lists.read_text(), re.M))
    return programs


def faults(guards, source):
    """A sentence for each entry of the list that does not fit the sources."""
    programs, names = cases_of_programs(source), set()
    for g in guards:
        name = g["name"]
        if name in names:
            yield f"{name}: the name of two guards; give each its own"
        names.add(name)
        file = source / g["file"]
        found = file.read_text().count(g["find"]) if file.is_file() else 0
        if found != 1:
            yield f"{name}: expected once in {g['file']}, found {found} times: {g['find']}; follow what the sources say now"
        if g["replace"] == g["find"] or not g["cases"]:
            yield f"{name}: expected a replacement that differs, and a case at least"
        for case in g["cases"]:
            if case not in programs.get(g["program"], ()):
                yield f"{name}: {g['program']} has no case {case}"


# ---- the copy, and what is built and run of it ----------------------------------------------------------------------

def write_if_other(file, text):
    """Ninja then rebuilds what differs, and nothing else."""
    if not file.is_file() or file.read_bytes() != text:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(text)


def copy_sources(source, copy):
    wanted = {pathlib.Path(name) for name in FILES}
    for folder in FOLDERS:
        for at, folders, files in os.walk(source / folder):
            folders[:] = [name for name in folders if name not in ("node_modules", "__pycache__")]
            wanted.update((pathlib.Path(at) / name).relative_to(source) for name in files)
    for name in wanted:
        write_if_other(copy / name, (source / name).read_bytes())
    for folder in FOLDERS:
        for file in (copy / folder).rglob("*"):
            if file.is_file() and file.relative_to(copy) not in wanted and "__pycache__" not in file.parts:
                file.unlink()


class Copy:
    """The sources in a folder of their own, and the programs built of them."""

    def __init__(self, source, folder, options):
        self.folder, self.build_folder = folder, folder / "build"
        copy_sources(source, folder)
        # The compiler cache then knows a file wherever it lies.
        # Cases that fail leave files, all in one folder.
        self.environment = dict(os.environ, CCACHE_BASEDIR=str(folder), TEST_TMPDIR=str(self.build_folder / "tests/files"))
        self.run_or_stop(["cmake", "--preset", "release", "-S", str(folder), "-B", str(self.build_folder),
                          "-DPALPATE_BUILD_PYTHON=OFF", *options])

    def run(self, command):
        return subprocess.run(command, cwd=self.folder, env=self.environment, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT)

    def run_or_stop(self, command):
        ended = self.run(command)
        if ended.returncode != 0:
            sys.exit(f"{ended.stdout}\n{shlex.join(command)}: ended with {ended.returncode}")

    def build_command(self, *programs):
        return ["cmake", "--build", str(self.build_folder), "-j", str(os.cpu_count()), "--target", *programs]

    def what_becomes_of(self, program, case):
        """passes, fails, crashes or hangs."""
        def limit():
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))

        command = [self.build_folder / "tests" / program, f"--gtest_filter={case}"]
        # A session of its own, so that programs that the case has started end with it.
        with subprocess.Popen(command, cwd=self.build_folder, env=self.environment, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, start_new_session=True, preexec_fn=limit) as running:
            try:
                said = running.communicate(timeout=TIME_LIMIT)[0]
            except subprocess.TimeoutExpired:
                os.killpg(running.pid, signal.SIGKILL)
                running.communicate()
                return "hangs"
        if f"[       OK ] {case}" in said and running.returncode == 0:
            return "passes"
        return "fails" if running.returncode > 0 else "crashes"


# ---- the study ------------------------------------------------------------------------------------------------------

def remove(copy, guard):
    """The verdict on one guard; the copy is as before then."""
    file, began = copy.folder / guard["file"], time.monotonic()
    whole = file.read_text()
    file.write_text(whole.replace(guard["find"], guard["replace"]))
    try:
        built = copy.run(copy.build_command(guard["program"]))
        if built.returncode != 0:
            verdict, cases = "does not compile", {}
            print(*built.stdout.splitlines()[-30:], sep="\n", file=sys.stderr)
        else:
            cases = {case: copy.what_becomes_of(guard["program"], case) for case in guard["cases"]}
            verdict = "UNNOTICED" if "passes" in cases.values() else "caught"
    finally:
        file.write_text(whole)
    return {"name": guard["name"], "group": guard["group"], "file": guard["file"], "verdict": verdict, "cases": cases,
            "seconds": round(time.monotonic() - began)}


def line(found):
    cases = ", ".join(f"{case} {what}" for case, what in found["cases"].items())
    return f"{found['verdict']:9} {found['seconds']:4} s  {found['file']}: {found['name']}{': ' if cases else ''}{cases}"


def study(guards, copy):
    """A verdict for each guard, or none where a case fails with every guard in its place."""
    programs = sorted({g["program"] for g in guards})
    copy.run_or_stop(copy.build_command(*programs))
    whole = {(g["program"], case) for g in guards for case in g["cases"]}
    broken = [case for program, case in sorted(whole) if copy.what_becomes_of(program, case) != "passes"]
    if broken:
        sys.exit(f"with every guard in its place these cases should pass, and do not: {', '.join(broken)}")
    results = []
    for guard in guards:
        results.append(remove(copy, guard))
        print(line(results[-1]), flush=True)
    return results


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("build", nargs="?", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="a folder for guards.json")
    parser.add_argument("--only", default="", help="the guards that have this in their name or file; no table is written")
    parser.add_argument("--cmake", default="", help="more options for cmake")
    parser.add_argument("--check", action="store_true", help="only whether the list fits the sources")
    options = parser.parse_args()
    source = options.source.resolve()
    guards = list(read(source))
    wrong = list(faults(guards, source))
    if wrong:
        print("tests/stability/guards.toml:", *wrong, sep="\n", file=sys.stderr)
        return 2
    if options.check:
        return 0
    if not options.build:
        parser.error("a build folder is needed to build in")
    chosen = [g for g in guards if options.only in g["name"] or options.only in g["file"]]
    if not chosen:
        print(f"no guard has {options.only} in its name or file", file=sys.stderr)
        return 2
    began = time.monotonic()
    results = study(chosen, Copy(source, options.build.resolve() / "guards", shlex.split(options.cmake)))
    count = {verdict: sum(r["verdict"] == verdict for r in results) for verdict in ("caught", "UNNOTICED", "does not compile")}
    summary = (f"{len(results)} guards removed one by one: {count['caught']} noticed by every case named, {count['UNNOTICED']} "
               f"not, {count['does not compile']} that do not compile; {(time.monotonic() - began) / 60:.0f} min")
    print(summary)
    if options.output and not options.only:
        options.output.mkdir(parents=True, exist_ok=True)
        (options.output / "guards.json").write_text(json.dumps(results, indent=1) + "\n")
        print(options.output / "guards.json")
    return 2 if count["does not compile"] else 3 if count["UNNOTICED"] else 0


if __name__ == "__main__":
    sys.exit(main())
