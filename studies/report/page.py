"""Writes a study's page: words, tables and plots in one HTML file that needs no other file, and each plot also as PNG.

    page = Page("What accuracy costs", "one sentence for the reader")
    page.heading("Error against cost")
    plot = Plot("force error against touch time", "touch, us", "force error, %", log_x=True, log_y=True)
    plot.points(xs, ys, names, label="p1-anp")      # the page shows a point's name while the pointer is over it
    plot.front(xs, ys, names)                       # joins and names the points that no other beats on both axes
    page.plot(plot, "force-touch")                  # also FOLDER/force-touch.png
    page.table(("mesh", "error, %"), rows)
    page.write("FOLDER/report.html")
"""
import argparse
import base64
import html
import io
import json
import math
import os
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import matplotlib.ticker  # noqa: E402

# Keep text as text in the SVG: it can then be searched and uses the page's font.
matplotlib.rcParams.update({"svg.fonttype": "none", "figure.max_open_warning": 0, "font.size": 10, "axes.spines.top": False,
                            "axes.spines.right": False, "axes.axisbelow": True})

COLOURS = ("#0b6fa4", "#c2410c", "#3f7d20", "#7c3aed", "#a16207", "#be185d", "#475569")
MARKERS = "os^Dv*P"
# An element has the same colour and marker on every page.
ELEMENTS = {"p1": ("#c2410c", "s"), "p1-anp": ("#0b6fa4", "o"), "p1-ang": ("#7c3aed", "D"), "p2-p0": ("#3f7d20", "^")}

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1c2530; background: #fff; max-width: 76rem; margin: 0 auto; padding: 1rem 1.5rem 4rem; }
h1 { font-size: 1.7rem; margin: .3rem 0 .2rem; } h2 { font-size: 1.25rem; margin: 2.2rem 0 .4rem; border-top: 1px solid #d5dce3; padding-top: 1rem; }
h3 { font-size: 1.05rem; margin: 1.2rem 0 .3rem; } p { margin: .4rem 0 .7rem; max-width: 62rem; }
.lead { color: #475569; } .cards, .plots { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(20rem, 1fr)); }
.plots { grid-template-columns: repeat(auto-fit, minmax(min(30rem, 100%), 1fr)); }
.card { border: 1px solid #c4ced8; border-top: 4px solid #0b6fa4; border-radius: .4rem; padding: .7rem 1rem; background: #f8fafc; }
.card h3 { margin-top: 0; } .card .choice { font-size: 1.2rem; font-weight: 600; } .card dl { display: grid; grid-template-columns: auto 1fr; gap: .1rem .8rem; margin: .4rem 0; }
.card dt { color: #475569; } .card dd { margin: 0; font-variant-numeric: tabular-nums; } code, pre { font-size: .85em; background: #eef2f6; padding: .1em .3em; border-radius: .2rem; }
pre { padding: .5rem; overflow-x: auto; white-space: pre-wrap; }
figure { margin: 0; max-width: 46rem; } figure svg, figure img { width: 100%; height: auto; } figure.wide { max-width: 76rem; } figcaption { color: #475569; font-size: .9rem; }
.scroll { overflow: auto; max-height: 36rem; } .scroll.whole { max-height: none; } .whole td { vertical-align: top; min-width: 5rem; } .whole td:nth-child(n+8) { min-width: 16rem; } table { border-collapse: collapse; font-size: .86rem; font-variant-numeric: tabular-nums; }
th { position: sticky; top: 0; background: #eef2f6; text-align: left; vertical-align: bottom; } th, td { padding: .2rem .6rem; border-bottom: 1px solid #e2e8f0; } td.number { text-align: right; }
summary { cursor: pointer; font-weight: 600; } svg g[id^="point-"]:hover { opacity: .55; }
"""


def number(value, digits=3):
    """A number with 3 digits; without an exponent between 0.001 and a million."""
    if value is None or isinstance(value, bool) or not isinstance(value, (int, float)):
        return "" if value is None else {True: "yes", False: "no"}.get(value, str(value))
    if value != value:
        return "unknown"
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.{digits}g}" if abs(value) < 10 ** digits else f"{value:,.0f}"
    return f"{value:.{max(digits - 2, 0)}e}"


def percent(share):
    """A share as per cents with 2 digits."""
    return "unknown" if share is None else f"{number(100 * share, 2)} %"


def pareto(xs, ys):
    """Indices of the points that no other point beats on both axes, from left to right. NaN is left out."""
    order = sorted((i for i in range(len(xs)) if xs[i] == xs[i] and ys[i] == ys[i]), key=lambda i: (xs[i], ys[i]))
    front = []
    for i in order:
        if not front or ys[i] < ys[front[-1]]:
            front.append(i)
    return front


class Plot:
    """One set of axes. Points have names, which the page shows while the pointer is over them."""

    def __init__(self, title, x_label, y_label, log_x=False, log_y=False, size=(7.2, 5.0)):
        self.title = title
        self.figure, self.axes = plt.subplots(figsize=size)
        self.axes.set_title(title, loc="left", fontsize=12, fontweight="bold")
        self.axes.set_xlabel(x_label)
        self.axes.set_ylabel(y_label)
        for axis, is_log in ((self.axes.xaxis, log_x), (self.axes.yaxis, log_y)):
            if is_log:
                (self.axes.set_xscale if axis is self.axes.xaxis else self.axes.set_yscale)("log")
                axis.set_major_formatter(lambda value, _: f"{value:g}")
                axis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        self.axes.grid(True, which="major", alpha=0.35)
        self.axes.grid(True, which="minor", alpha=0.12)
        self.names, self.opens, self.series, self.labels, self.legend_at = {}, {}, 0, [], "best"

    def points(self, xs, ys, names, label=None, joined=False, faint=False, hollow=False, opens=(), **style):
        """Points with names; joined: connected by a line; opens: what each opens, data-opens of its element, for a script of the page."""
        colour = style.pop("color", COLOURS[self.series % len(COLOURS)])
        marker = style.pop("marker", MARKERS[self.series % len(MARKERS)])
        self.series += 1
        if joined:
            self.axes.plot(xs, ys, "-", color=colour, alpha=0.6, linewidth=1.3, **style)
        for n, (x, y, name) in enumerate(zip(xs, ys, names)):
            gid = f"point-{len(self.names)}"
            self.names[gid] = name
            self.opens[gid] = f' data-opens="{html.escape(opens[n])}"' if opens else ""
            self.axes.plot([x], [y], marker, color=colour, markerfacecolor="white" if hollow else colour, gid=gid, markersize=5 if faint else 6.5,
                           alpha=0.45 if faint else 1, label=label if n == 0 else None, linestyle="none")
        return colour

    def curve(self, rows, x, y, told, joined=True, opens=None, **style):
        """A point for each row of a study. x, y: keys of the row, or functions of it; told: a function that names it; opens: see points."""
        xs, ys = ([of(row) if callable(of) else row[of] for row in rows] for of in (x, y))
        self.points(xs, ys, [told(row) for row in rows], joined=joined, opens=[opens(row) for row in rows] if opens else (), **style)

    def front(self, xs, ys, names):
        """Draws the Pareto front as steps, and names its points where there is room."""
        front = pareto(xs, ys)
        self.axes.step([xs[i] for i in front], [ys[i] for i in front], where="post", color="#1c2530", linewidth=1.1,
                       alpha=0.7, label="no other setting is better on both axes")
        self.labels = [(xs[i], ys[i], names[i]) for i in front]
        return front

    def _name_the_front(self):
        """Writes names beside points: to the left of points in the right half; leaves out a name that would cover another."""
        taken = []
        for x, y, name in self.labels:
            across, up = self.axes.transAxes.inverted().transform(self.axes.transData.transform((x, y)))
            left = across > 0.55
            begin, end = (across - 0.014 * len(name), across) if left else (across, across + 0.014 * len(name))
            if any(abs(up - other) < 0.05 and begin < o_end and end > o_begin for other, o_begin, o_end in taken):
                continue
            taken.append((up, begin, end))
            self.axes.annotate(name, (x, y), xytext=(-6 if left else 6, 7), textcoords="offset points",
                               ha="right" if left else "left", fontsize=8)

    def band(self, most, text):
        """Shades the y axis below `most`, where differences have no meaning, and writes the reason."""
        low = self.axes.get_ylim()[0]
        self.axes.axhspan(min(low, most / 3), most, color="#94a3b8", alpha=0.25, linewidth=0)
        self.axes.annotate(text, (0.01, most), xycoords=("axes fraction", "data"), xytext=(0, -3), ha="left", va="top",
                           textcoords="offset points", fontsize=8, color="#475569")

    def line(self, xs, ys, label, **style):
        self.axes.plot(xs, ys, label=label, **style)

    def svg(self, prefix):
        """The plot as SVG, each name a <title>. prefix: different for each plot of a page."""
        matplotlib.rcParams["svg.hashsalt"] = prefix
        text = io.StringIO()
        self.figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
        svg = text.getvalue()
        svg = svg[svg.index("<svg"):]
        svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
        for gid, name in self.names.items():
            svg = svg.replace(f'<g id="{gid}">', f'<g id="point-{prefix}-{gid[6:]}"{self.opens[gid]}><title>{html.escape(name)}</title>', 1)
        return svg

    def _place_the_legend(self):
        """Below the axes where the legend is so large that it would cover points."""
        entries = len(self.axes.get_legend_handles_labels()[0])
        if entries > 5:
            columns = 2
            self.figure.set_figheight(self.figure.get_figheight() + 0.2 * math.ceil(entries / columns))
            self.axes.legend(fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(0, -0.12), ncols=columns)
        elif entries:
            self.axes.legend(fontsize=8, framealpha=0.85, loc=self.legend_at)

    def finish(self):
        self._place_the_legend()
        for axis in (self.axes.xaxis, self.axes.yaxis):
            if axis.get_scale() == "log":
                least, most = sorted(axis.get_view_interval())
                subs = (1, 2, 5) if most < 2000 * least else (1,)
                axis.set_major_locator(matplotlib.ticker.LogLocator(subs=subs, numticks=8))
        self.figure.tight_layout()
        self._name_the_front()


class Study:
    """What a study measured: .all, its JSON."""

    def __init__(self, file):
        with open(file) as stream:
            self.all = json.load(stream)

    def machine(self):
        """Where and by what it was measured, and how busy the machine was."""
        machine = self.all["machine"]
        return (f"{machine['processor']}, {machine['cores']} cores; load when the study ended: {number(machine['load'])} (times vary on a busy "
                f"machine). palpate {self.all['program_version']}")


def write_report(description, study_type, title_and_lead, *sections):
    """The main of a report: reads the study that the command line names, writes its page and returns the study. title_and_lead: a function
    of the study; each section is a function of the page and the study."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("study")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    study = study_type(arguments.study)
    page = Page(*title_and_lead(study))
    for section in sections:
        section(page, study)
    page.write(arguments.output)
    return study


class Page:
    def __init__(self, title, lead):
        self.title, self.parts, self.pictures = title, [], {}
        self.parts.append(f"<h1>{html.escape(title)}</h1><p class=lead>{lead}</p>")

    def heading(self, text, level=2, anchor=None):
        """anchor: the target of <a href='#anchor'>."""
        mark = f" id={anchor}" if anchor else ""
        self.parts.append(f"<h{level}{mark}>{html.escape(text)}</h{level}>")

    def words(self, markup):
        """A paragraph of HTML."""
        self.parts.append(f"<p>{markup}</p>")

    def cards(self, cards):
        """Boxes side by side: (heading, choice, [(name, value)], HTML below)."""
        boxes = []
        for heading, choice, facts, below in cards:
            rows = "".join(f"<dt>{html.escape(k)}</dt><dd>{html.escape(v)}</dd>" for k, v in facts)
            boxes.append(f"<div class=card><h3>{html.escape(heading)}</h3><div class=choice>{html.escape(choice)}</div>"
                         f"<dl>{rows}</dl>{below}</div>")
        self.parts.append(f"<div class=cards>{''.join(boxes)}</div>")

    def plot(self, plot, name, caption=""):
        self.plots([(plot, name, caption)])

    def plots(self, plots):
        """Plots side by side if there is room: (Plot, name of the PNG, caption)."""
        figures = []
        for plot, name, caption in plots:
            plot.finish()
            self.pictures[name] = plot
            figures.append(f"<figure>{plot.svg(name)}<figcaption>{caption}</figcaption></figure>")
        self.parts.append(f"<div class=plots>{''.join(figures)}</div>")

    def picture(self, file, caption):
        """Includes a PNG file in the page."""
        with open(file, "rb") as stream:
            data = base64.b64encode(stream.read()).decode()
        self.parts.append(f'<figure class=wide><img src="data:image/png;base64,{data}" alt="{html.escape(caption)}">'
                          f"<figcaption>{html.escape(caption)}</figcaption></figure>")

    def table(self, head, rows, folded=None, whole=False):
        """Rows of texts and numbers. folded: the title of a table that is hidden until the reader opens it. whole: no scroll bar."""
        def cell(value):
            kind = " class=number" if isinstance(value, (int, float)) and not isinstance(value, bool) else ""
            return f"<td{kind}>{html.escape(number(value) if not isinstance(value, str) else value)}</td>"
        markup = (f"<div class='scroll{' whole' if whole else ''}'><table><thead><tr>" + "".join(f"<th>{html.escape(h)}</th>" for h in head) +
                  "</tr></thead><tbody>" + "".join("<tr>" + "".join(map(cell, row)) + "</tr>" for row in rows) +
                  "</tbody></table></div>")
        self.parts.append(f"<details><summary>{html.escape(folded)}</summary>{markup}</details>" if folded else markup)

    def write(self, file):
        """Writes the page and its PNG files; each is written as FILE.part and then renamed."""
        def whole(path, write):
            write(path + ".part")
            os.replace(path + ".part", path)

        folder = os.path.dirname(os.path.abspath(file))
        for name, plot in self.pictures.items():
            whole(os.path.join(folder, name + ".png"), lambda part, p=plot: p.figure.savefig(part, format="png", dpi=120))
            plt.close(plot.figure)
        text = (f'<!DOCTYPE html><html lang=en><head><meta charset=utf-8><title>{html.escape(self.title)}</title>'
                '<meta name=viewport content="width=device-width, initial-scale=1">'
                f"<style>{STYLE}</style></head><body>{''.join(self.parts)}</body></html>\n")

        def write_text(part):
            with open(part, "w", encoding="utf-8") as stream:
                stream.write(text)
        whole(os.path.abspath(file), write_text)
