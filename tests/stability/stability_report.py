"""Runs the cases of tests/stability. Writes their figures and their sweeps as a page and as JSON.

    stability_report.py PROGRAM... -o FOLDER [--long] [--filter PATTERN]
"""
import argparse
import html
import itertools
import json
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "studies" / "report"))
from page import ELEMENTS, Page, Plot  # noqa: E402

# The sweeps in the order of the page: title, axis labels, scales, and what the reader should conclude.
SWEEPS = {
    "node against nu": (
        "Force on one displaced node against Poisson's ratio", "1/2 - Poisson's ratio (incompressible to the left)", "force over that of p2-p0", "log", "linear",
        "Node contact, cube of 60 mm with edges of 7.5 mm, E 5.4 kPa. The force on a single node depends on mesh and element: that p1-anp is 30 to "
        "40 % below p2-p0 says nothing about its accuracy. The slope does: p1 locks towards 1/2 (4 times the force); p1-anp does not."),
    "disc against nu": (
        "Force on a disc against Poisson's ratio", "1/2 - Poisson's ratio (incompressible to the left)", "force over that of p2-p0", "log", "linear",
        "Contact patch, sticking: a disc of 15 mm radius pressed by 1 mm into the same meshes. This is the force that a tool feels: p1-anp stays "
        "within 1.1 % of the quadratic p2-p0 up to nu 0.4 and 4 % up to 0.4999; p1 stays within 2.3 % up to 0.495 and is 23 % too stiff at 0.4999. "
        "Use p1-anp or p2-p0 for soft tissue."),
    "error against sliver angle": (
        "Error of a node's tensor against a sliver's angle", "least dihedral angle of a tetrahedron, degrees", "relative error", "log", "log",
        "Cube of 2 x 2 x 2 cells, one tetrahedron nearly flat; reference solved with 64 bits of mantissa. Slivers above 1e-4 degrees cost "
        "less than 1e-8 of accuracy: a single flat tetrahedron is no reason to reject a mesh."),
    "iterations against contrast": (
        "CG with multigrid: iterations against contrast", "Young's modulus of the stiff material over the soft one",
        "iterations to a residual of 1e-7", "log", "linear",
        "p1-anp, cube of 8 x 8 x 8 cells, nu 0.45. The number of iterations levels off with the contrast: tissue beside bone needs at most "
        "some four times the iterations of one material."),
    "conflicting pair": (
        "Force of two contacts that contradict each other", "distance of the contact points over an edge of the mesh", "force on one contact, N",
        "log", "log",
        "Point contacts in neighbouring triangles, displaced by 1 mm in opposite directions. As the points come closer the force grows, then "
        "stays finite: the contact solver bounds it."),
}


def run(program, long_form, pattern):
    """Runs one program; returns its JSON lines and its exit code."""
    files = pathlib.Path(program).resolve().parent / "files"  # the folder that ctest uses (tests/CMakeLists.txt)
    files.mkdir(exist_ok=True)
    environment = dict(os.environ, PALPATE_STABILITY_LONG="1" if long_form else "0", TEST_TMPDIR=str(files))
    found, said = [], []
    command = [program, f"--gtest_filter={pattern}", "--gtest_color=no"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as running:
        for line in running.stdout:
            if line.startswith('{"stability"'):
                found.append(json.loads(line))
            else:
                said.append(line)
                if line.startswith(("[ RUN", "[  FAILED", "[       OK")):
                    print(line, end="", flush=True)
    if running.returncode != 0:
        sys.stderr.writelines(line for line in said if not line.startswith("["))
    return found, running.returncode


def margin(figure):
    """The bound over the measured figure."""
    measured, bound = figure["measured"], figure["bound"]
    if not figure["held"] or isinstance(measured, str) or isinstance(bound, str):
        return "none"
    if measured <= 0:
        return "exact"
    return f"{bound / measured:.3g}"


def tables(page, figures):
    for (group, case, threat), own in itertools.groupby(figures, lambda f: (f["group"], f["case"], f["threat"])):
        page.heading(f"{group.removeprefix('Stability')}: {case}", 3)
        page.words(html.escape(threat))
        page.table(("figure", "measured", "bound", "margin", "held", "reason of the bound", "s"),
                   [(f["figure"], f["measured"], f["bound"], margin(f), "held" if f["held"] else "LOST", f["reason"], f["seconds"]) for f in own], whole=True)


def sweeps(page, points):
    plots = []
    for sweep, (title, x_name, y_name, x_scale, y_scale, conclusion) in SWEEPS.items():
        curves = {}
        for p in points:
            if p["sweep"] == sweep and not isinstance(p["y"], str):
                curves.setdefault(p["curve"], []).append((p["x"], p["y"]))
        plot = Plot(title, x_name, y_name, log_x=x_scale == "log", log_y=y_scale == "log")
        for name, values in curves.items():
            plot.line(*zip(*sorted(values)), name, marker=".", **({"color": ELEMENTS[name][0]} if name in ELEMENTS else {}))
        if curves:
            plots.append((plot, sweep.replace(" ", "-"), conclusion))
    page.plots(plots)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    parser.add_argument("--long", action="store_true", help="the long form of every case: about half an hour")
    parser.add_argument("--filter", default="*", help="names of cases, a pattern as in --gtest_filter")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    lines, failed = [], []
    for program in options.programs:
        found, code = run(program, options.long, options.filter)
        lines += found
        if code != 0:
            failed.append(f"{os.path.basename(program)} ended with {code}")
    figures = [x for x in lines if x["stability"] == "figure"]
    points = [x for x in lines if x["stability"] == "point"]
    if not figures:
        print(f"no case matches {options.filter}", file=sys.stderr)
        return 2
    lost = sum(not f["held"] for f in figures)
    form = "long" if options.long else "quick"
    cases = len({(f["group"], f["case"]) for f in figures})
    seconds = sum(f["seconds"] for f in figures)
    summary = (f"{cases} cases, {len(figures)} figures, {form} form, {seconds:.0f} s of processor time; "
               f"{lost} figures outside their bounds. {'; '.join(failed)}")
    (options.output / "report.json").write_text(json.dumps(lines, indent=1) + "\n")
    page = Page("Stability", html.escape(summary))
    sweeps(page, points)
    tables(page, figures)
    page.write(str(options.output / "report.html"))
    print(f"{summary}\n{options.output}/report.html")
    return 3 if lost or failed else 0


if __name__ == "__main__":
    sys.exit(main())
