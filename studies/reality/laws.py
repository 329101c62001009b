"""Laws of two and three constants, fitted to curves of cylinders between plates: Yeoh's (mu, c2, c3) and Ogden's (mu, exponent).

Between plates that slide the stretches are the same everywhere, so the force is a closed form. Where the plates stick, bodies are solved for a
table of constants, and polynomials go between them.
"""
import itertools

import numpy as np

LAWS = ("yeoh", "ogden")
YEOH_C2 = (-0.16, -0.08, 0.0, 0.08, 0.16)      # over the shear modulus
YEOH_ABOVE = (0.003, 0.015, 0.035, 0.06, 0.1)  # c3 over the shear modulus, above the least that the law takes with c2
OGDEN = ((1.5, 2.0, 3.0, 4.0, 5.0, 6.0), (-6.0, -5.0, -4.0, -3.0))
DEGREE = 4
ZOOMS, CELLS = 5, 21  # of the search for the least sum of squares


def least_c3(c2):
    """docs/files.md, `yeoh`: 3 c2^2 < 5 (mu / 2) c3 where c2 is below 0."""
    return np.where(np.asarray(c2) < 0, 1.2 * np.square(c2), 0.0)


def branches(law):
    """Tables of constants whose force goes over into one another: rows of (c2, c3 above the least one), or of (exponent,)."""
    if law == "yeoh":
        return [np.array(list(itertools.product(YEOH_C2, YEOH_ABOVE)))]
    return [np.array(branch)[:, None] for branch in OGDEN]


def constants(law, row):
    """As the law's options take them."""
    return [float(row[0]), float(row[1] + least_c3(row[0]))] if law == "yeoh" else [float(row[0])]


def sliding_ratio(law, rows, strains):
    """[row][strain] force over that of the neo-Hookean law of the same shear modulus, incompressible."""
    stretch = 1 - np.asarray(strains)[None, :]
    if law == "yeoh":
        first = stretch ** 2 + 2 / stretch - 3
        c2, c3 = rows[:, :1], rows[:, 1:] + least_c3(rows[:, :1])
        return 1 + 4 * c2 * first + 6 * c3 * first ** 2
    a = rows[:, :1]
    return 2 / a * (stretch ** (-a / 2 - 1) - stretch ** (a - 1)) / (1 / stretch ** 2 - stretch)


class Table:
    """The same from bodies that were solved at each row of a branch: ratios[row][strain]."""

    def __init__(self, rows, strains, ratios):
        self.middle, self.half = rows.mean(axis=0), (rows.max(axis=0) - rows.min(axis=0)) / 2
        self.strains = np.asarray(strains)
        self.degree = min(DEGREE, min(len(set(column)) for column in rows.T) - 1)
        self.weights = np.linalg.lstsq(self.terms(rows), np.log(ratios), rcond=None)[0]
        self.off = float(np.max(np.abs(np.expm1(self.terms(rows) @ self.weights - np.log(ratios)))))

    def terms(self, rows):
        x = (rows - self.middle) / self.half
        powers = [p for p in itertools.product(range(self.degree + 1), repeat=x.shape[1]) if sum(p) <= self.degree]
        return np.stack([np.prod(x ** np.array(p), axis=1) for p in powers], axis=1)

    def ratio(self, rows, strains):
        known = np.exp(self.terms(rows) @ self.weights)
        return np.stack([np.interp(strains, self.strains, row) for row in known])


def fit(branch_ratios, neo_hookean, strains, forces):
    """The least sum of squares of relative differences over all branches [(rows, ratio(rows, strains))], neo_hookean: force over shear modulus.
    Returns (shear modulus, row, ratio, root mean square)."""
    best = None
    for rows, ratio in branch_ratios:
        low, high = rows.min(axis=0), rows.max(axis=0)
        centre, half = (low + high) / 2, (high - low) / 2
        for _ in range(ZOOMS):
            axes = [np.clip(np.linspace(c - h, c + h, CELLS), a, b) for c, h, a, b in zip(centre, half, low, high)]
            grid = np.array(list(itertools.product(*axes)))
            share = ratio(grid, strains) * neo_hookean / forces
            shear = share.sum(axis=1) / (share ** 2).sum(axis=1)
            squares = ((shear[:, None] * share - 1) ** 2).mean(axis=1)
            at = int(np.argmin(squares))
            if best is None or squares[at] < best[3] ** 2:
                best = float(shear[at]), grid[at], ratio, float(np.sqrt(squares[at]))
            centre, half = grid[at], half / 5
    return best
