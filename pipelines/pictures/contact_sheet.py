#!/usr/bin/env python3
"""contact_sheet.py CASE -o HTML: one page of a case (the folder of a bundle): every picture, the mesh's quality, the certificate of the
bundle, what was verified, and the warnings of all steps."""
import argparse
import glob
import html
import json
import os
import subprocess

import case_warnings

STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.45 sans-serif; max-width: 1500px; margin: 1.5em auto; padding: 0 1em; }
figure { margin: 1.5em 0; } img { max-width: 100%; background: white; border-radius: 4px; }
pre { overflow-x: auto; padding: .8em; border: 1px solid #8886; border-radius: 4px; font-size: 14px; }
table { border-collapse: collapse; } td, th { padding: .25em .9em .25em 0; text-align: left; vertical-align: top; }
.warning { color: #b2182b; } @media (prefers-color-scheme: dark) { .warning { color: #ff8a8a; } }
"""


def read_json(file):
    with open(file) as stream:
        return json.load(stream)


def table(rows, head):
    """rows: lists of text."""
    cells = ["<tr>%s</tr>" % "".join("<%s>%s</%s>" % (kind, html.escape(str(cell)), kind) for cell in row)
             for kind, group in (("th", [head]), ("td", rows)) for row in group]
    return "<table>%s</table>" % "\n".join(cells)


def scene_rows(scenes):
    rows = []
    for scene in scenes:
        for tool in read_json(os.path.join(scene, "summary.json"))["tools"]:
            touched = "first_contact_s" in tool and tool["first_contact_s"] is not None
            rows.append([os.path.basename(scene), tool["name"], "%.3g" % tool["peak_force_N"], "%.3g" % tool["peak_time_s"],
                         "%.3g" % tool["first_contact_s"] if touched else "never", ", ".join(tool["flags"]) or "none"])
    return rows


def flat(value, name=""):
    """[(name, text)] of the numbers and texts in JSON, with the names of what they stand in."""
    if isinstance(value, dict):
        return [row for key, inner in value.items() for row in flat(inner, (name + " " + key).strip())]
    if isinstance(value, list) and any(isinstance(inner, (dict, list)) for inner in value):
        return [row for i, inner in enumerate(value) for row in flat(inner, "%s %d" % (name, i + 1))]
    text = ", ".join("%.4g" % n if isinstance(n, float) else str(n) for n in (value if isinstance(value, list) else [value]))
    return [(name.replace("_", " "), text)]


def page(case, pictures, quality, info, warnings, output):
    scenes = sorted(os.path.dirname(f) for f in glob.glob(os.path.join(case, "scenes", "*", "summary.json")))
    verified = read_json(os.path.join(case, "verified.json"))
    title = html.escape(os.path.relpath(case, os.path.dirname(os.path.dirname(os.path.dirname(case)))))
    parts = ["<h1>%s</h1>" % title, "<h2>Warnings</h2>"]
    parts += ["<ul>%s</ul>" % "".join('<li class="warning">%s: %s</li>' % (html.escape(step), html.escape(sentence))
                                      for step, sentence in warnings) if warnings else "<p>No step has a warning.</p>"]
    parts += ["<h2>Pictures</h2>"]
    for picture in pictures:
        name = os.path.relpath(picture, os.path.dirname(os.path.abspath(output)))
        parts.append('<figure><a href="%s"><img src="%s" alt="%s" loading="lazy"></a></figure>' % ((html.escape(name, True),) * 3))
    if scenes:
        parts += ["<h2>Scenes</h2>", table(scene_rows(scenes), ["scene", "tool", "peak force, N", "at, s", "first contact, s", "flags"])]
    if quality:
        parts += ["<h2>Quality of the mesh</h2>", table(flat({k: v for k, v in quality.items() if k != "warnings"}), ["figure", "value"])]
    parts += ["<h2>Verified</h2>", table([[check["name"], "holds" if check["held"] else "does NOT hold", check["detail"]]
                                          for check in verified["checks"]], ["check", "", "found"]),
              "<h2>The bundle and its certificate</h2>", "<pre>%s</pre>" % html.escape(info)]
    return ('<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
            "<title>%s</title><style>%s</style></head><body>%s</body></html>\n" % (title, STYLE, "\n".join(parts)))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--palpate-bundle", default="palpate-bundle", help="the program that describes the bundle")
    parser.add_argument("--mesh-quality", help="the JSON that palpate-tetrahedra --report wrote")
    parser.add_argument("--pictures", nargs="*", default=[])
    case_warnings.add_arguments(parser)
    arguments = parser.parse_args()
    case = os.path.abspath(arguments.case)
    info = subprocess.run([arguments.palpate_bundle, "info", os.path.join(case, "bundle.h5")], check=True, capture_output=True,
                          text=True).stdout
    quality = read_json(arguments.mesh_quality) if arguments.mesh_quality else None
    with open(arguments.output + ".part", "w") as stream:
        stream.write(page(case, arguments.pictures, quality, info,
                          case_warnings.warnings_of(arguments.reports, arguments.cases or [case]), arguments.output))
    os.replace(arguments.output + ".part", arguments.output)


if __name__ == "__main__":
    main()
