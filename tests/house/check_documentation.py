"""check_documentation.py ROOT [PROGRAMS]: what the Markdown pages say exists.

- Every link leads to a file, and its #part to a heading of that file.
- Every path in backticks that begins with a folder of the repository (or of the page's) exists.
- Every target of `make -f Makefile.data` and `make -f pipelines/built.mk` exists, and so does ORGAN=NAME.
- Every option of a program of ours exists in its --help (with PROGRAMS, the folder of the built programs).
- Every fenced code block says what it is: ```c, ```cpp, ```python, ```js, ```ts, ```html are a part of a file that the tests
  compile or run; ```sh, ```toml, ```make belong to a page that a test follows (tests/house/run_page.py) or reads (READ
  below), or stand behind <!-- not run: WHY -->; ```text and ```mermaid are shown only.
- The organs in pipelines/README.md have the resolutions and boundary sets that it lists.
- The smallest example programs of tests/embed stand whole on some page.
- Every variable of organ.mk that pipelines/rules.mk uses is in docs/files.md, and the other way round.
- docs/troubleshooting.md has each PALPATE_STEP_ flag, with its number, and each PALPATE_ERROR_ status of palpate.h, and no others; and each
  sentence that it quotes from the sources is there (see quoted_sentences)."""
import pathlib
import re
import subprocess
import sys

root = pathlib.Path(sys.argv[1]).resolve()
programs = pathlib.Path(sys.argv[2]).resolve() if len(sys.argv) > 2 else None
failures = []

FOLLOWED = {"docs/your-organ.md"}  # tests/house/CMakeLists.txt
READ = {"docs/files.md": ("toml", "make"), "formats/BUNDLE.md": ("python",)}  # files_page_test.cpp, read_with_h5py.py
TESTED_CODE = ("tests/embed", "tests/web", "bindings/web", "bindings/python", "bindings/csharp", "runtime", "tests/runtime")
LANGUAGES = {"c": (".c", ".h"), "cpp": (".cpp", ".h"), "python": (".py",), "csharp": (".cs",), "js": (".js", ".mjs", ".html"), "ts": (".ts",),
             "html": (".html",), "cmake": ("CMakeLists.txt", ".cmake")}

tracked = subprocess.run(["git", "-C", root, "ls-files"], check=True, capture_output=True, text=True).stdout.splitlines()
tracked = [name for name in tracked if (root / name).is_file()]
pages = {name: (root / name).read_text() for name in tracked if name.endswith(".md")}
folders = {str(parent) for name in tracked for parent in pathlib.PurePosixPath(name).parents}
FENCE = re.compile(r"(?:^<!-- ([^\n]*?) -->\n)?^```([\w-]*)[^\n]*\n(.*?)^```$", re.S | re.M)


def fail(page, sentence):
    failures.append("%s: %s" % (page, sentence))


# ---- links and paths -------------------------------------------------------------------------------------------------

def anchors(text):
    """The names that forges give to headings."""
    without_code = FENCE.sub("", text)
    titles = re.findall(r"^#+ (.*?)\s*$", without_code, re.M)
    plain = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title) for title in titles]
    names = [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in plain]
    return set(names) | set(re.findall(r'<a (?:id|name)="([^"]+)"', text))


def check_links(page, text):
    plain = FENCE.sub("", text)
    links = re.findall(r"\]\(([^)#:\s]*)(?:#([^)\s]*))?\)", plain)
    for target, part in links + [(image, "") for image in re.findall(r'<img src="([^":]+)"', plain)]:
        file = (root / page).parent / target if target else root / page
        if not file.exists():
            fail(page, "link to %s, which does not exist" % target)
        elif part and file.suffix == ".md" and part not in anchors(file.read_text()):
            fail(page, "link to %s#%s, which is no heading there" % (target, part))


def is_placeholder(path):
    return bool(re.search(r"[<>{}$]|\.\.\.|(^|/|-)[A-Z]{2,}(?=[-./]|$)", re.sub(r"(README|BUNDLE|CHANGELOG|CONTRIBUTING|ABI|"
                          r"LICENSE|ELEMENTS|SOLVER|MULTIGRID|TETRAHEDRA|STABILITY)\b|CMakeLists", "", path)))


def exists(path, base):
    if "*" in path:
        return any(base.glob(path))
    return (base / path).exists()


def check_paths(page, text):
    here = (root / page).parent
    for path in re.findall(r"`([\w.*<>{}$-]+(?:/[\w.*<>{}$-]+)+/?)`", text):
        first = path.split("/")[0]
        if is_placeholder(path) or first in ("build", "data", "build-sanitize", "build-fuzz"):
            continue
        relative = str(pathlib.PurePosixPath(page).parent / first)
        bases = [root] if first in folders else []
        bases += [here] if relative in folders else []
        # `solver/column_solver` means the .h and .cpp of that name.
        if bases and not any(exists(path, base) or exists(path + ".*", base) for base in bases):
            fail(page, "`%s`, which does not exist" % path)


# ---- commands --------------------------------------------------------------------------------------------------------

def makefile_targets():
    text = "".join((root / name).read_text() for name in ("Makefile.data", "pipelines/rules.mk", "pipelines/built.mk"))
    names = re.findall(r"^([\w-]+(?: [\w-]+)*)\s*:(?!=)", text, re.M)
    return {word for line in names for word in line.split()}


def commands(text):
    """Each command line of the page's blocks and inline code, continuation lines joined."""
    code = [content for _, language, content in FENCE.findall(text) if language not in ("c", "cpp", "python", "js", "ts")]
    rest = FENCE.sub("", text)
    code += re.findall(r"^(?: {4}|\t)(.*(?:\\\n.*)*)", rest, re.M)
    code += re.findall(r"`([^`\n]+(?:\n[^`\n]+)?)`", rest)
    for block in code:
        for line in re.sub(r"\\\n\s*", " ", block).splitlines():
            # Two blanks end the command of a table of commands; so do ; | and a comment.
            for command in re.split(r"[;|]|&&|\s#|\s{3,}", line):
                yield command.strip()


def check_make(page, command, targets, organs):
    found = re.search(r"\bmake\b(.*)-f \S*(?:Makefile\.data|built\.mk)(.*)", command)
    if not found:
        return
    quoted = re.sub(r"""=('[^']*'|"[^"]*")""", "=x", found[1] + found[2])
    for word in re.sub(r"-C \S+", "", quoted).split():
        organ = re.fullmatch(r"ORGAN=([a-z][\w-]*)", word)
        made = re.findall(r"\bNAME=([\w-]+)", pages[page])  # by new-organ on the same page
        if organ and organ[1] not in organs and "my-" not in organ[1] and organ[1] not in made:
            fail(page, "make ORGAN=%s: there are %s" % (organ[1], ", ".join(sorted(organs))))
        if re.fullmatch(r"[a-z][a-z-]*", word) and word not in targets:
            fail(page, "make target %s, which neither Makefile.data nor pipelines/rules.mk has" % word)


helps = {}


def help_of(words):
    if words not in helps:
        run = subprocess.run([programs / words[0], *words[1:], "--help"], capture_output=True, text=True)
        helps[words] = set(re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", run.stdout))
    return helps[words]


SUBCOMMANDS = {"palpate-bundle": "info|verify|diff|pack", "palpate-accuracy": "choose|check"}


def check_options(page, command):
    found = re.match(r"(?:.*[\s/(])?(palpate-[a-z]+)\b(.*)", command)
    if not found or not programs or not any(n == "programs/%s.cpp" % found[1].replace("-", "_") for n in tracked):
        return
    if not (programs / found[1]).exists():
        sys.exit("%s is not built in %s; expected all programs" % (found[1], programs))
    words = (found[1],)
    sub = re.match(r"\s+(%s)\b" % SUBCOMMANDS[found[1]], found[2]) if found[1] in SUBCOMMANDS else None
    words += (sub[1],) if sub else ()
    ours = re.split(r"\s-- ", found[2])[0]  # behind "--" come PETSc's options
    for option in re.findall(r"(?<=\s)(--?[A-Za-z][\w-]*)", re.sub(r"""'[^']*'|"[^"]*\"""", "", ours)):
        if option not in help_of(words):
            fail(page, "%s %s, which its --help does not have" % (" ".join(words), option))


# ---- code blocks -----------------------------------------------------------------------------------------------------

def tested_sources(language):
    for name in tracked:
        if name.startswith(TESTED_CODE) and name.endswith(LANGUAGES[language]):
            yield (root / name).read_text()


def dedented(text):
    return "\n".join(line.strip() for line in text.strip().splitlines())


def check_block(page, remark, language, content):
    shown = "%s ```%s block that begins with %r" % ("a", language, content.strip().split("\n")[0])
    if remark.startswith("not run: ") and len(remark) > 12:
        return
    if language in ("text", "mermaid"):
        return
    if language in READ.get(page, ()):
        return
    if language in LANGUAGES:
        if not any(dedented(content) in dedented(source) for source in tested_sources(language)):
            fail(page, "%s is no part of a file that the tests compile or run (%s)" % (shown, ", ".join(TESTED_CODE)))
    elif language in ("sh", "toml", "make", "csv"):
        if page not in FOLLOWED:
            fail(page, "%s: no test follows this page; put <!-- not run: WHY --> in front" % shown)
    else:
        fail(page, "%s has no language that says what it is; see check_documentation.py" % shown)


def check_examples():
    """The programs of tests/embed that a reader sees first stand on a page, whole; pages link to the longer ones."""
    blocks = [content for text in pages.values() for _, _, content in FENCE.findall(text)]
    for name in ("example.c", "example.py"):
        file = root / "tests/embed" / name
        if file.exists() and file.read_text() not in blocks:
            fail("tests/embed/" + name, "no code block of a page equals it; copy its text into the page that explains it")


# ---- organ.mk and palpate.h ------------------------------------------------------------------------------------------

def check_organ_mk():
    rules = (root / "pipelines/rules.mk").read_text()
    data = (root / "Makefile.data").read_text()
    rules_alone = re.sub(r"^\s*#.*$", "", rules, flags=re.M)
    used = set(re.findall(r"\$\(([A-Z_]+)[):]", rules_alone)) | set(re.findall(r"^ifdef ([A-Z_]+)", rules_alone, re.M))
    defined = set(re.findall(r"^([A-Z_]+)\s*[:?]?=", re.sub(r"^MATERIALS \?= organ$", "", rules_alone, flags=re.M) + data, re.M))
    defined |= {"MAKE", "MAKECMDGOALS", "MAKEFILE_LIST", "ORGAN_DIR", "MEMORY"}
    text = pages["docs/files.md"].split("## organ.mk")[1]
    listed = set(re.findall(r"^\| `([A-Z_]+)`", text, re.M))
    for name in sorted((used - defined) - listed):
        fail("docs/files.md", "pipelines/rules.mk uses %s, which the table of organ.mk does not list" % name)
    for name in sorted(listed - used):
        fail("docs/files.md", "%s is not used by pipelines/rules.mk" % name)


def check_organs():
    """The table of organs: resolutions and boundary sets are those that there are."""
    page = "pipelines/README.md"
    for organ in sorted(organs_there()):
        row = re.search(r"^\| `%s` \|([^|]*)\|([^|]*)\|" % organ, pages[page], re.M)
        makefile = (root / "pipelines" / organ / "organ.mk").read_text()
        resolutions = [n for line in re.findall(r"^(?:LARGER_)?RESOLUTIONS := (.*)$", makefile, re.M) for n in line.split()]
        sets = sorted(file.stem for file in (root / "pipelines" / organ / "boundary").glob("*.toml"))
        if not row:
            fail(page, "no row for the organ %s" % organ)
        elif re.findall(r"`([^`]+)`", row[1]) != resolutions or sorted(re.findall(r"`([^`]+)`", row[2])) != sets:
            fail(page, "%s: expected the resolutions %s and the boundary sets %s" % (organ, resolutions, sets))


def organs_there():
    return {pathlib.PurePosixPath(n).parts[1] for n in tracked if re.fullmatch(r"pipelines/[^/]+/organ\.mk", n)}


def check_troubleshooting():
    header = "".join((root / "runtime/include/palpate" / name).read_text() for name in ("palpate.h", "palpate_bundle.h"))
    page = "docs/troubleshooting.md"
    for pattern, kind in ((r"\bPALPATE_STEP_[A-Z_]+\b", "step flag"), (r"\bPALPATE_ERROR_[A-Z_]+\b", "status")):
        there = set(re.findall(pattern + r"(?=\s*=)", header))
        listed = set(re.findall(r"^\| `(" + pattern[2:-2] + r")` \|", pages[page], re.M))
        for name in sorted(there - listed):
            fail(page, "no entry for the %s %s of palpate.h" % (kind, name))
        for name in sorted(listed - there):
            fail(page, "%s is no %s of palpate.h" % (name, kind))
    numbers = {name: 1 << int(bit) for name, bit in re.findall(r"\b(PALPATE_STEP_[A-Z_]+)\s*=\s*1 << (\d+)", header)}
    stated = {name: int(number) for name, number in re.findall(r"^\| `(PALPATE_STEP_[A-Z_]+)` \| (\d+) \|", pages[page], re.M)}
    for name in sorted(numbers.keys() | stated.keys()):
        if numbers.get(name) != stated.get(name):
            fail(page, "%s: expected the number %s of palpate.h, found %s" % (name, numbers.get(name), stated.get(name)))


def literals(name):
    """The text of a source's string literals, those that the compiler joins joined; {} for each format field."""
    text = re.sub(r"^\s*//.*$", "", (root / name).read_text(), flags=re.M)
    found = re.findall(r'"((?:[^"\\\n]|\\.)*)"(\s*)(?=(")?)', text)
    joined, current = [], ""
    for body, _, continues in found:
        current += body
        if not continues:
            joined.append(current)
            current = ""
    return [re.sub(r"\{[^{}]*\}", "{}", literal.replace('\\"', '"').replace("\\n", "")) for literal in joined]


def quoted_sentences():
    """docs/troubleshooting.md quotes messages in its first column, ... for what varies. Each must be in a source; and each
    source file that throws must have a message on the page or stand in the page's list of files."""
    page = "docs/troubleshooting.md"
    sources = [n for n in tracked if n.endswith((".cpp", ".h")) and
               n.startswith(("formats/", "meshing/", "precompute/", "programs/", "studies/", "runtime/"))]
    texts = {name: literals(name) for name in sources}
    found_in = set()
    for quoted in re.findall(r"^\| `([^`]+)` \|", pages[page], re.M):
        if quoted.startswith("PALPATE_"):
            continue
        parts = [part.strip() for part in re.split(r"\.\.\.|…", quoted.replace("\\|", "|")) if part.strip()]
        holding = [name for name, all_of in texts.items()
                   if any(in_order(parts, literal) for literal in all_of)]
        if not holding:
            fail(page, "no source says `%s`" % quoted)
        found_in.update(holding)
    throwing = {name for name in sources if throws_a_sentence((root / name).read_text())}
    for name in sorted(throwing - found_in):
        fail(page, "%s throws, and the page quotes no sentence of it" % name)


def throws_a_sentence(text):
    """Whether an error has words of ours; what only passes a library's words on has none."""
    for thrown in re.findall(r"\b(?:InputError|OperationError|VerificationError)\((.*?);\n", text, re.S):
        if any(re.search(r"[a-z]+ [a-z]+ ", body) for body in re.findall(r'"((?:[^"\\]|\\.)*)"', thrown)):
            return True
    return False


def in_order(parts, literal):
    at = 0
    for part in parts:
        at = literal.find(part, at)
        if at < 0:
            return False
        at += len(part)
    return True


def main():
    targets = makefile_targets()
    organs = organs_there()
    for page, text in pages.items():
        check_links(page, text)
        if page != "CHANGELOG.md":  # of a time when other files existed
            check_paths(page, FENCE.sub("", text))
            for command in commands(text):
                check_make(page, command, targets, organs)
                check_options(page, command)
        for remark, language, content in FENCE.findall(text):
            check_block(page, remark, language, content)
    check_examples()
    check_organ_mk()
    check_organs()
    check_troubleshooting()
    quoted_sentences()
    print("\n".join(failures))
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
