#!/usr/bin/env python3
"""contact_sheet.py CASE -o HTML: one page of a case (the folder of a bundle): what the organ is made of and what of that is assumed, every
picture with a caption, the mesh's quality, the certificate of the bundle, what was verified, and the warnings of all steps."""
import argparse
import glob
import html
import json
import os
import subprocess

import h5py

import case_warnings

STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.45 sans-serif; max-width: 1500px; margin: 1.5em auto; padding: 0 1em; }
figure { margin: 1.5em 0; } img { max-width: 100%; background: white; border-radius: 4px; }
pre { overflow-x: auto; padding: .8em; border: 1px solid #8886; border-radius: 4px; font-size: 14px; }
table { border-collapse: collapse; } td, th { padding: .25em .9em .25em 0; text-align: left; vertical-align: top; }
.warning, .assumed { color: #b2182b; } figcaption { margin-top: .4em; } @media (prefers-color-scheme: dark) { .warning, .assumed { color: #ff8a8a; } }
"""


# Of force and displaced surface, %, on the default liver with each of two boundary sets: 1,696 vertices, nu 0.49, a disc of 10 mm radius pressed
# in by 5 mm; against quadratic elements on 19,656 vertices. The figures of docs/accuracy.md, as a test of the pictures holds; None: it has none.
ELEMENT_ERRORS = {"right-side": {"p1": (7.6, 12), "p1-anp": (3.2, 5.5), "p2-p0": (2.6, 8.5)},
                  "abdomen": {"p1": (18, None), "p1-anp": (9.0, 22), "p2-p0": (12, None)}}
CAPTIONS = {
    "mesh": "The mesh: the size of its tetrahedra, and how good they are.",
    "boundary": "What holds the organ: blue and striped is held, the other colours are named below the picture. Only the touchable part has an answer.",
    "force": "Force against depth of a push, with the linear law and with the measured curve.",
}
SCENE_CAPTION = ("Scene \"%s\" at its largest force, from two sides: the colour is how far the surface has moved, the dashed line where the "
                 "organ lies at rest; red arrows are forces on the tools, all in one scale; what else is seen is named below the picture. %s")


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


def is_assumed(source):
    """Files say "assumed", "an assumption"."""
    return "assum" in source


def stated_error(said):
    """What the bundle states (palpate-bundle pack --accuracy); else what the element does on the default liver, held as this organ is. Where the
    boundary set has no figure, that of each set that has one, with the set's name."""
    if "accuracy_force_error" in said and "accuracy_field_error" in said:
        return ("measured on this organ, a disc of %.3g mm radius: the force %.2g %% off, the displaced surface %.2g %%"
                % (said["accuracy_radius_mm"], 100 * said["accuracy_force_error"], 100 * said["accuracy_field_error"]))
    said_so = "not measured on this case, which make accuracy does."
    own = said["boundary"] if said["boundary"] in ELEMENT_ERRORS else None
    figures = ["with the boundary set %s the force is %.2g %% off%s"
               % (boundary, errors[said["element"]][0],
                  "" if errors[said["element"]][1] is None else ", the displaced surface %.2g %%" % errors[said["element"]][1])
               for boundary, errors in ELEMENT_ERRORS.items() if own in (None, boundary) and said["element"] in errors]
    if not figures:
        return said_so
    return said_so + (" On the default liver %s: 1,696 vertices, a disc of 10 mm radius pressed in by 5 mm at six places, root mean square"
                      % "; ".join(figures))


def own_stiffness(said):
    """What palpate-precompute measured of the element (formats/BUNDLE.md)."""
    if not said.get("element_probes", 0):
        return "not measured"
    return ("the element makes this mesh too stiff by about %.2g %%: an estimate, the median of %d loads; the largest %.2g %%"
            % (100 * said["element_excess_median"], said["element_probes"], 100 * said["element_excess"]))


def what_it_is(bundle):
    """[(what, text, whether it is assumed)] of the organ, from what the bundle says of itself."""
    with h5py.File(bundle, "r") as file:
        said = {key: value for key, value in file.attrs.items()}
        names = file["material/names"][()].tobytes().decode().splitlines()
        young, poisson = file["material/young"][:], file["material/poisson"][:]
        nodes, touchable = len(file["mesh/nodes"]), len(file["tensors/nodes"])
    rows = [("organ", "%s, held as %s says; %d vertices, of which %d may be touched" % (said["organ"], said["boundary"], nodes, touchable), False)]
    for name, stiffness, ratio in zip(names, young, poisson):
        for kind, text in (("young", "Young's modulus %.3g kPa" % (stiffness / 1e3)), ("poisson", "Poisson's ratio %.3g" % ratio)):
            source = str(said.get("%s_source %s" % (kind, name), "not stated"))
            rows.append(("%s, %s" % (name, "stiffness" if kind == "young" else "volume"), "%s: %s" % (text, source), is_assumed(source)))
    rows += [(key, str(said[key]), is_assumed(str(said[key]))) for key in sorted(said) if key.startswith(("foundation ", "spring "))]
    rows.append(("element", said["element"] + ": " + stated_error(said), False))
    rows.append(("own stiffness", own_stiffness(said), False))
    rows.append(("units", "Pictures and tables are in mm and N, files in m and N. Axes: %s." % said.get("frame", "none"), False))
    return rows


def caption_of(picture, case):
    name = os.path.splitext(os.path.basename(picture))[0]
    summary = os.path.join(case, "scenes", name, "summary.json")
    if not os.path.exists(summary):
        return CAPTIONS.get(name, "")
    tools = read_json(summary)["tools"]
    return SCENE_CAPTION % (name, " ".join("%s: at most %.3g N." % (tool["name"], tool["peak_force_N"]) for tool in tools))


def page(case, pictures, quality, info, warnings, output):
    scenes = sorted(os.path.dirname(f) for f in glob.glob(os.path.join(case, "scenes", "*", "summary.json")))
    verified = read_json(os.path.join(case, "verified.json"))
    title = html.escape(os.path.relpath(case, os.path.dirname(os.path.dirname(os.path.dirname(case)))))
    parts = ["<h1>%s</h1>" % title, "<h2>Warnings</h2>"]
    parts += ["<ul>%s</ul>" % "".join('<li class="warning">%s: %s</li>' % (html.escape(step), html.escape(sentence))
                                      for step, sentence in warnings) if warnings else "<p>No step has a warning.</p>"]
    parts += ["<h2>What this is</h2>", "<table>%s</table>" % "\n".join(
        "<tr><th>%s</th><td%s>%s</td></tr>" % (html.escape(what), ' class="assumed"' if assumed else "", html.escape(text))
        for what, text, assumed in what_it_is(os.path.join(case, "bundle.h5")))]
    parts += ["<h2>Pictures</h2>"]
    for picture in pictures:
        name = os.path.relpath(picture, os.path.dirname(os.path.abspath(output)))
        parts.append('<figure><a href="%s"><img src="%s" alt="%s" loading="lazy"></a><figcaption>%s</figcaption></figure>'
                     % ((html.escape(name, True),) * 3 + (html.escape(caption_of(picture, case)),)))
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
