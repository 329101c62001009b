#!/usr/bin/env python3
"""case_warnings.py ORGAN --reports STEP=JSON ... --cases [NAME=]CASE ...: prints the warnings of all steps that an organ was made by.

Each step writes its warnings into a JSON file: the surface and the mesh into those of --reports, the bundle and the scenes into those of
their case, the folder of a bundle."""
import argparse
import glob
import json
import os
import sys


def sentences_of(file):
    if not os.path.exists(file):
        return ["%s is missing, so that this step's warnings are not known; remove what the step made, and make it anew" % file]
    with open(file) as stream:
        return json.load(stream)["warnings"]


def warnings_of(reports, cases):
    """[(step, sentence)]. reports: STEP=FILE or ORGAN:STEP=FILE each; cases: FOLDER or NAME=FOLDER, named in the step where they are several."""
    files = [(step.replace(":", ": "), file) for step, _, file in (report.partition("=") for report in reports)]
    for case in cases:
        given, equals, folder = case.partition("=")
        given, case = (given, folder) if equals and "/" not in given else ("", case)
        name = (given or os.path.basename(os.path.normpath(case))) + ": " if len(cases) > 1 else ""
        files.append((name + "bundle", os.path.join(case, "bundle-report.json")))
        files += [("%sscene %s" % (name, os.path.basename(os.path.dirname(summary))), summary)
                  for summary in sorted(glob.glob(os.path.join(case, "scenes", "*", "summary.json")))]
    return [(step, sentence) for step, file in files for sentence in sentences_of(file)]


def add_arguments(parser):
    parser.add_argument("--reports", nargs="*", default=[], metavar="STEP=JSON")
    parser.add_argument("--cases", nargs="*", default=[], metavar="[NAME=]CASE")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("organ")
    add_arguments(parser)
    parser.add_argument("--strict", action="store_true", help="exit code 3 where there is a warning")
    arguments = parser.parse_args()
    warnings = warnings_of(arguments.reports, arguments.cases)
    count = {0: "no step has a warning", 1: "1 warning of all steps:"}.get(len(warnings), "%d warnings of all steps:" % len(warnings))
    print("%s: %s" % (arguments.organ, count))
    for step, sentence in warnings:
        print("  %s: %s" % (step, sentence))
    if arguments.strict and warnings:
        sys.exit(3)


if __name__ == "__main__":
    main()
