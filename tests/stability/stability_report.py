"""Runs the cases of tests/stability and writes what they measured: a table in HTML, the same as JSON, a picture of the sweeps.

    stability_report.py PROGRAM... -o FOLDER [--long] [--filter PATTERN]
"""
import argparse
import html
import json
import os
import pathlib
import subprocess
import sys

STYLE = """body{font:15px/1.4 sans-serif;max-width:76em;margin:2em auto;padding:0 1em}table{border-collapse:collapse;width:100%}
td,th{text-align:left;vertical-align:top;padding:.25em .6em;border-bottom:1px solid #ddd}td.n{text-align:right;white-space:nowrap}
tr.threat td{background:#f4f4f4}tr.lost td{background:#fdd}img{max-width:100%}"""

# sweep: axes, and how they are scaled.
SWEEPS = {
    "conflicting pair": ("gap / edge", "force, N", "log", "log"),
    "force against nu": ("1/2 - Poisson's ratio", "force over that of p2-p0", "log", "linear"),
    "error against sliver angle": ("dihedral angle, degrees", "relative error", "log", "log"),
    "iterations against contrast": ("contrast of stiffness", "iterations", "log", "linear"),
}


def run(program, long_form, pattern):
    """The lines of one program, and its exit status."""
    files = pathlib.Path(program).resolve().parent / "files"  # as ctest has it (tests/CMakeLists.txt)
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
    """How many times the measured figure fits into its bound."""
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
    """The sweeps that have points, in one PNG; its name, or none."""
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
    figure, places = pyplot.subplots((len(sweeps) + 1) // 2, 2, figsize=(11, 4 * ((len(sweeps) + 1) // 2)), squeeze=False)
    for axes in places.flat[len(sweeps):]:
        axes.set_axis_off()
    for axes, (sweep, curves) in zip(places.flat, sweeps.items()):
        x_name, y_name, x_scale, y_scale = SWEEPS[sweep]
        for name, values in curves.items():
            axes.plot(*zip(*sorted(values)), marker=".", label=name)
        axes.set(xlabel=x_name, ylabel=y_name, xscale=x_scale, yscale=y_scale, title=sweep)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "sweeps.png", dpi=90)
    return ["sweeps.png"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    parser.add_argument("--long", action="store_true", help="the long form of every case: hours")
    parser.add_argument("--filter", default="*", help="cases by name, as --gtest_filter")
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
               f"{lost} figures beyond their bounds. {'; '.join(failed)}")
    (options.output / "report.json").write_text(json.dumps(lines, indent=1) + "\n")
    (options.output / "report.html").write_text(
        f"<!doctype html><meta charset=utf-8><title>Stability</title><style>{STYLE}</style><h1>Stability</h1>"
        f"<p>{html.escape(summary)}</p>{''.join(f'<img src={name!r} alt={name!r}>' for name in pictures)}{table(figures)}\n")
    print(f"{summary}\n{options.output}/report.html")
    return 3 if lost or failed else 0


if __name__ == "__main__":
    sys.exit(main())
