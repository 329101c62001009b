"""What the scripts that draw a picture share: the command line, what a played scene wrote, axes, and the file, with the warnings of the
scenes that it shows above its title."""
import argparse
import csv
import json
import os
import textwrap

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402, F401

WARNING = "#b2182b"
FONT, LINE = 11, 0.21  # points, inches from line to line
MOST = 4  # warnings; summary.json has the others


def arguments(description, shown, **more):
    """The command line of a script that draws one picture: what it shows, and -o."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument(shown, **more)
    parser.add_argument("-o", "--output", required=True)
    return parser.parse_args()


LENGTHS = {"cm": 1e-2, "mm": 1e-3, "um": 1e-6}


def read_csv(file):
    """The rows, by their columns' names. Lengths of a scene with another csv_unit are there in metres as well."""
    with open(file, newline="") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    for name in list(rows[0]) if rows else []:
        start, _, unit = name.rpartition("_")
        for row in rows if unit in LENGTHS else []:
            row.setdefault(start + "_m", repr(LENGTHS[unit] * float(row[name])) if row[name] else "")
    return rows


def vector(row, name, unit):
    return np.array([float(row["%s_%s_%s" % (name, axis, unit)]) for axis in "xyz"])


def finish_plot(panel, xlabel, ylabel):
    """Of curves that begin at zero."""
    panel.set_xlabel(xlabel, fontsize=15)
    panel.set_ylabel(ylabel, fontsize=15)
    panel.tick_params(labelsize=13)
    panel.set_xlim(left=0)
    panel.set_ylim(bottom=0)
    panel.grid(color="0.9")
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def warnings_of(scenes):
    """What palpate-run warned of in these scenes (folders), each sentence once, with the scene's name where there are several."""
    sentences = []
    for scene in scenes:
        with open(os.path.join(scene, "summary.json")) as stream:
            found = json.load(stream).get("warnings", [])
        name = "%s: " % os.path.basename(os.path.normpath(scene)) if len(scenes) > 1 else ""
        sentences += [name + sentence for sentence in found if name + sentence not in sentences]
    return sentences


def add_warnings(figure, sentences):
    """Makes room above the figure, and writes the sentences there."""
    width, height = figure.get_size_inches()
    shown = sentences[:MOST] + (["%d more in summary.json" % (len(sentences) - MOST)] if len(sentences) > MOST else [])
    lines = [line for sentence in shown for line in textwrap.wrap("warning: " + sentence, int(11 * width), subsequent_indent="   ")]
    whole = height + LINE * len(lines) + 0.15
    places = [(axes, axes.get_position()) for axes in figure.axes]
    for axes, place in places:
        axes.set_position([place.x0, place.y0 * height / whole, place.width, place.height * height / whole])
    for text in figure.texts:  # the figure's own title
        text.set_y(text.get_position()[1] * height / whole)
    figure.set_size_inches(width, whole)
    figure.text(0.01, 1 - 0.08 / whole, "\n".join(lines), va="top", fontsize=FONT, color=WARNING, linespacing=1.25)


def save(figure, output, scenes=()):
    """Writes the whole PNG or none. The same input gives the same bytes. scenes: the folders of the played scenes that the picture
    shows; their warnings stand above the picture, and in the PNG's text "Warnings"."""
    sentences = warnings_of(scenes)
    if sentences:
        add_warnings(figure, sentences)
    metadata = {"Software": None, **({"Warnings": "\n".join(sentences)} if sentences else {})}
    os.makedirs(os.path.dirname(os.path.abspath(output)), exist_ok=True)
    figure.savefig(output + ".part", format="png", dpi=120, facecolor="white", metadata=metadata)
    os.replace(output + ".part", output)
