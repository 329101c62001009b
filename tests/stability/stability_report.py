"""Runs the cases of tests/stability. Writes their figures as a table in HTML and as JSON, and a picture of the sweeps.

    stability_report.py PROGRAM... -o FOLDER [--long] [--filter PATTERN]
"""
import argparse
import html
import json
import os
import pathlib
import subprocess
import sys
import textwrap

STYLE = """body{font:15px/1.4 sans-serif;max-width:76em;margin:2em auto;padding:0 1em}table{border-collapse:collapse;width:100%}
td,th{text-align:left;vertical-align:top;padding:.25em .6em;border-bottom:1px solid #ddd}td.n{text-align:right;white-space:nowrap}
tr.threat td{background:#f4f4f4}tr.lost td{background:#fdd}img{max-width:100%}"""

# An element looks as it does on the pages of studies/.
STYLES = {"p1": {"color": "#c2410c"}, "p1-anp": {"color": "#0b6fa4"}, "p2-p0": {"color": "#3f7d20"}}

# The sweeps in the order of the picture: title, axis labels, scales, and what the reader should conclude.
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


def short(x):
    return x if isinstance(x, str) else f"{x:.3g}"


def table(figures):
    rows, threat = [], None
    for f in figures:
        name = f"{f['group'].removeprefix('Stability')}: {f['case']}"
        if (name, f["threat"]) != threat:
            threat = (name, f["threat"])
            rows.append(f"<tr class=threat><td colspan=6><b>{html.escape(name)}</b> {html.escape(f['threat'])}</td></tr>")
        rows.append(
            f"<tr{'' if f['held'] else ' class=lost'}><td>{html.escape(f['figure'])}</td><td class=n>{short(f['measured'])}</td>"
            f"<td class=n>{short(f['bound'])}</td><td class=n>{margin(f)}</td><td>{html.escape(f['reason'])}</td>"
            f"<td class=n>{f['seconds']:.2f}</td></tr>")
    head = "<tr><th>figure<th>measured<th>bound<th>margin<th>reason of the bound<th>s</tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def draw(points, folder):
    """Draws the sweeps that have points into one PNG file; returns its name, or nothing."""
    try:
        import matplotlib
    except ImportError:
        print("no picture: matplotlib (python3-matplotlib) is not installed", file=sys.stderr)
        return []
    matplotlib.use("Agg")
    from matplotlib import pyplot

    sweeps = {}
    for p in points:
        if not isinstance(p["y"], str):
            sweeps.setdefault(p["sweep"], {}).setdefault(p["curve"], []).append((p["x"], p["y"]))
    if not sweeps:
        return []
    ordered = [name for name in SWEEPS if name in sweeps]
    rows = (len(ordered) + 1) // 2
    figure, panels = pyplot.subplots(rows, 2, figsize=(12, 5.4 * rows), squeeze=False)
    for axes in panels.flat[len(ordered):]:
        axes.set_axis_off()
    for axes, sweep in zip(panels.flat, ordered):
        title, x_name, y_name, x_scale, y_scale, conclusion = SWEEPS[sweep]
        for name, values in sweeps[sweep].items():
            axes.plot(*zip(*sorted(values)), marker=".", label=name, **STYLES.get(name, {}))
        axes.set(xlabel=x_name, ylabel=y_name, xscale=x_scale, yscale=y_scale)
        axes.set_title(title, loc="left", fontsize=11, fontweight="bold")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
        axes.text(0, -0.17, "\n".join(textwrap.wrap(conclusion, 80)), transform=axes.transAxes, va="top", fontsize=9)
    figure.subplots_adjust(left=0.07, right=0.98, top=1 - 0.35 / (5.4 * rows), bottom=1.6 / (5.4 * rows), wspace=0.18, hspace=0.5)
    figure.savefig(folder / "sweeps.png", dpi=80)
    return ["sweeps.png"]


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
    pictures = draw(points, options.output)
    lost = sum(not f["held"] for f in figures)
    form = "long" if options.long else "quick"
    cases = len({(f["group"], f["case"]) for f in figures})
    seconds = sum(f["seconds"] for f in figures)
    summary = (f"{cases} cases, {len(figures)} figures, {form} form, {seconds:.0f} s of processor time; "
               f"{lost} figures outside their bounds. {'; '.join(failed)}")
    (options.output / "report.json").write_text(json.dumps(lines, indent=1) + "\n")
    (options.output / "report.html").write_text(
        f"<!doctype html><meta charset=utf-8><title>Stability</title><style>{STYLE}</style><h1>Stability</h1>"
        f"<p>{html.escape(summary)}</p>{''.join(f'<img src={name!r} alt={name!r}>' for name in pictures)}{table(figures)}\n")
    print(f"{summary}\n{options.output}/report.html")
    return 3 if lost or failed else 0


if __name__ == "__main__":
    sys.exit(main())
