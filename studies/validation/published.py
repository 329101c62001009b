#!/usr/bin/env python3
"""published.py VALIDATION_JSON [PAGE]: the published numbers of the validation study and ours, as a Markdown table. With PAGE, it takes the
place of the lines between the two marks of that page (docs/accuracy.md)."""
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
from page import number  # noqa: E402

BEGIN = "<!-- published numbers: written by studies/validation/published.py -->"
END = "<!-- end of the published numbers -->"
SHOWN = ("p1-anp", "p1-ang", "p2-p0")
EXACT = 1e-5  # cases with smaller bounds are exact on every mesh: nothing was published about them


def finest(study, case, series):
    points = [p for p in study["points"] if p["case"] == case["id"] and all(p[k] == series[k] for k in ("element", "poisson", "quantity"))]
    return points[-1]


def ours(study, case, quantity, poisson, element):
    """The value on the finest mesh and its error, of an element that is judged there."""
    for series in case["series"]:
        if (series["quantity"], series["poisson"], series["element"]) == (quantity, poisson, element) and series["judged"]:
            point = finest(study, case, series)
            return f"{number(point['value'], 4)} ({number(100 * point['error'], 2)} %)"
    return ""


def rows(study):
    for case in study["cases"]:
        exact_ones = {s["quantity"] for s in case["series"] if s["bound"] is not None and s["bound"] <= EXACT}
        shown = [s for s in case["series"] if s["judged"] and s["quantity"] not in exact_ones and s["element"] in SHOWN]
        for quantity, poisson in dict.fromkeys((s["quantity"], s["poisson"]) for s in shown):
            one = next(s for s in shown if (s["quantity"], s["poisson"]) == (quantity, poisson))
            exact = finest(study, case, one)["exact"]
            if exact is not None:  # else the error of a whole field
                yield (f"`{case['id']}`", f"{case['title']}, nu {poisson:.4g}: {quantity}", case["source"], number(exact, 4),
                       *(ours(study, case, quantity, poisson, element) for element in SHOWN))


def table(study):
    head = ("CASE", "quantity", "source", "theirs", *(f"ours: `{element}`" for element in SHOWN))
    head, *lines = ("| " + " | ".join(row) + " |\n" for row in (head, *rows(study)))
    return head + "|---" * (2 + len(SHOWN) + 2) + "|\n" + "".join(lines)


def write_into(page, text):
    with open(page, encoding="utf-8") as stream:
        whole = stream.read()
    begin, end = whole.index(BEGIN) + len(BEGIN), whole.index(END)
    with open(page + ".part", "w", encoding="utf-8") as stream:
        stream.write(f"{whole[:begin]}\n{text}{whole[end:]}")
    os.replace(page + ".part", page)


if __name__ == "__main__":
    with open(sys.argv[1]) as file:
        made = table(json.load(file))
    if len(sys.argv) > 2:
        write_into(sys.argv[2], made)
    else:
        print(made, end="")
