"""Reads measured curves from a folder that the user brings. README.md beside this file says what the columns hold.

A file that cannot be used is refused by Refused, in one sentence: the file, the row, what was expected and what was found.
"""
import csv
import glob
import math
import os

CYLINDERS, BEAMS = "cylinder-compression*.csv", "beam-markers*.csv"


class Refused(Exception):
    pass


# ---- what a cell may hold: (the words of the sentence, the check) ----

POSITIVE = ("a number above 0", lambda x: x > 0)
NOT_NEGATIVE = ("a number of at least 0", lambda x: x >= 0)
SHARE = ("a number above 0 and below 1", lambda x: 0 < x < 1)
NUMBER = ("a number", lambda x: True)

CYLINDER_COLUMNS = {"silicone": None, "specimen": None, "strain": SHARE, "compression_mm": POSITIVE, "force_N": NUMBER}
FITTED = (0.05, 0.5)  # strains: below, the toe of the contact is larger than a model's error
BEAM_COLUMNS = {"case": None, "repeat": None, "load_N": NOT_NEGATIVE, "marker": None,
                **{f"{what}_{axis}_mm": NUMBER for what in ("nominal", "start", "moved") for axis in "xyz"}, "sd_last_second_mm": NOT_NEGATIVE}


class Row(dict):
    """A row's cells by their columns, and where it stands."""

    def __init__(self, cells, file, line):
        super().__init__(cells)
        self.file, self.line = file, line

    def refuse(self, expected, found):
        raise Refused(f"{self.file}, row {self.line}: expected {expected}, found {found}")


def rows_of(file, columns):
    """The rows of a CSV file as Row; lines that begin with # are comments. Every column holds a text, or a number that its check passes."""
    with open(file, newline="", encoding="utf-8", errors="replace") as stream:
        lines = [(number, line) for number, line in enumerate(stream, 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise Refused(f"{file}, row 1: expected the names of the columns, found no row")
    table = list(csv.reader(line for _, line in lines))
    head = [name.strip() for name in table[0]]
    missing = [name for name in columns if name not in head]
    if missing:
        raise Refused(f"{file}, row {lines[0][0]}: expected the column {missing[0]}, found {', '.join(head)}")
    rows = []
    for (line, _), cells in zip(lines[1:], table[1:]):
        row = Row({}, file, line)
        if len(cells) != len(head):
            row.refuse(f"{len(head)} cells", len(cells))
        for name, check in columns.items():
            text = cells[head.index(name)].strip()
            if check is None:
                if not text:
                    row.refuse(f"a name in {name}", "an empty cell")
                row[name] = text
                continue
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if not (math.isfinite(value) and check[1](value)):
                row.refuse(f"{check[0]} in {name}", repr(text))
            row[name] = value
        rows.append(row)
    if not rows:
        raise Refused(f"{file}, row {lines[-1][0] + 1}: expected a measured row, found the end of the file")
    return rows


def read_cylinders(folder):
    """{silicone: {specimen: {strain: force in N}}} and the height in mm; an empty dict where the folder has no such file."""
    silicones, height = {}, None
    for file in sorted(glob.glob(os.path.join(folder, CYLINDERS))):
        for row in rows_of(file, CYLINDER_COLUMNS):
            own = row["compression_mm"] / row["strain"]
            height = height or own
            if abs(own / height - 1) > 0.01:
                row.refuse(f"compression_mm / strain of {height:.4g} mm, the height, as in the first row", f"{own:.4g}")
            curve = silicones.setdefault(row["silicone"], {}).setdefault(row["specimen"], {})
            if curve and row["strain"] <= max(curve):
                row.refuse(f"a strain above {max(curve):g}, the one before of {row['silicone']} {row['specimen']}", f"{row['strain']:g}")
            if row["strain"] >= FITTED[0] and row["force_N"] <= 0:
                row.refuse(f"{POSITIVE[0]} in force_N from a strain of {FITTED[0]:g} on", f"{row['force_N']:g}")
            curve[row["strain"]] = row["force_N"]
    for name, specimens in silicones.items():
        if len(specimens) < 2:
            raise Refused(f"{file}: expected two specimens or more of {name}, found {len(specimens)}")
        for specimen, curve in specimens.items():
            inside = sum(FITTED[0] <= s <= FITTED[1] for s in curve)
            if inside < 3:
                raise Refused(f"{file}: expected three strains or more from {FITTED[0]:g} to {FITTED[1]:g} of {name} {specimen}, found {inside}")
    return silicones, height


def read_beam(folder):
    """[Row] of all markers; an empty list where the folder has no such file. One load_N is 0 (the own weight), one at least is not."""
    rows, seen = [], {}
    for file in sorted(glob.glob(os.path.join(folder, BEAMS))):
        for row in rows_of(file, BEAM_COLUMNS):
            place = row["case"], row["repeat"], row["marker"]
            if place in seen:
                row.refuse("one row for each case, repeat and marker", f"{' '.join(place)} a second time")
            if seen.setdefault(row["case"], row["load_N"]) != row["load_N"]:
                row.refuse(f"the load {seen[row['case']]:g} N, as in the rows before of {row['case']}", f"{row['load_N']:g}")
            seen[place] = row
            rows.append(row)
    if rows and not (any(r["load_N"] == 0 for r in rows) and any(r["load_N"] > 0 for r in rows)):
        raise Refused(f"{rows[0].file}, rows {rows[0].line} to {rows[-1].line}: expected a case with load_N 0 and one with more, "
                      f"found {', '.join(sorted({str(r['load_N']) for r in rows}))}")
    return rows


def read_folder(folder):
    """(silicones, height in mm, rows of the beam)."""
    silicones, height = read_cylinders(folder)
    beam = read_beam(folder)
    if not silicones and not beam:
        raise Refused(f"{folder}: expected {CYLINDERS} or {BEAMS}, found neither")
    return silicones, height, beam
