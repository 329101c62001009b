#!/usr/bin/env python3
"""report.py FOLDER/cut.json -o FOLDER/report.html: the page of the study of cuts."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
import page as report  # noqa: E402
from page import Plot, number  # noqa: E402

WORDS = {"split": "split nodes", "removed": "removed tetrahedra"}
COLUMNS = (("element", "element"), ("cut", "cut"), ("stored", "stored as"), ("rebases_at", "re-based at rank"), ("rebased", "times re-based"), ("count", "changes"), ("rank", "rank"),
           ("slots", "nodes that it acts on"), ("compliance_error", "error of the compliance"), ("force_error", "largest error of a force"),
           ("change_us", "a change, us"), ("worst_us", "worst of the last 20, us"), ("contact_us", "a new contact node, us"),
           ("between_us", "a pair of them, us"), ("region_nodes", "nodes of the region"),
           ("region_MB", "columns in the bundle, MB"), ("loose", "changes refused as loose"), ("least_share", "least share of stiffness"))


def told(row):
    return (f"{row['element']}, {row['count']} {WORDS[row['cut']]}, {row['stored']}, re-based {row['rebased']} times: rank {row['rank']}, "
            f"error {number(row['compliance_error'])}, {number(row['change_us'])} us a change, {number(row['contact_us'])} us a contact node")


def plots(page, study):
    made = []
    for cut, words in WORDS.items():
        rows = [p for p in study.all["points"] if p["cut"] == cut]
        error = Plot(f"Error after {words}", words, "error of the compliance", log_x=True, log_y=True)
        time = Plot(f"Time of a change: {words}", "rank", "us", log_y=True)
        for element in dict.fromkeys(p["element"] for p in rows):
            for stored in dict.fromkeys(p["stored"] for p in rows):
                own = [p for p in rows if p["element"] == element and p["stored"] == stored and not p["rebases_at"]]
                error.curve(own, "count", "compliance_error", told, label=f"{element}, {stored}")
                if stored == "f64":
                    time.curve(own, "rank", "change_us", told, label=element)
        made += [(error, f"error-{cut}", ""), (time, f"time-{cut}", "")]
    page.plots(made)


def figures(page, study):
    page.heading("Exactness and cost")
    page.words("A plane through the middle of the organ is cut from its far side, node by node; or the tetrahedra nearest to its far end are removed. After "
               "1, 10, 30, 100, 200 and 300 changes the compliance between 20 places of the surface and up to 20 new nodes is compared with that of the "
               "cut mesh, assembled and factored anew (2-norm, relative), and so is the force that holds one of them displaced (the worst). Times: "
               "processor time of the thread, medians of the last 20 changes and of 40 contact nodes. Where a compliance is re-based, that is at a rank of 300.")
    plots(page, study)
    page.table([title for _, title in COLUMNS], [[p[key] for key, _ in COLUMNS] for p in study.all["points"]])


def everything(page, study):
    page.heading("How it was measured")
    page.words(f"{study.machine()}; {study.all['mesh']}, held as {study.all['boundary']} says; took {number(study.all['took_s'])} s. As data: "
               "<code>cut.json</code> and <code>cut.csv</code>.")


def title_and_lead(study):
    return (f"Cuts: {study.all['nodes']:,} nodes, {study.all['tetrahedra']:,} tetrahedra",
            "How exact a cut is that follows the stored compliance by a low rank, and what it takes.")


if __name__ == "__main__":
    report.write_report(__doc__, report.Study, title_and_lead, figures, everything)
