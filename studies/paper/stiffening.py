"""Fits the law that stiffens (docs/method.md, section 14) to a measured compression: two numbers, E and b.

    W = mu / (2 b) (exp(b x) - 1) + kappa / 2 (J - 1)^2,   x = J^(-2/3) I - 3,   E = 2 mu (1 + nu)
"""
import numpy as np

POISSON = 0.499  # brain is nearly incompressible; the strain of the cylinder is uniform, so that no element locks


def derivatives(stretch, width, b, kappa):
    """dW/d(stretch) and dW/d(width) / 2 for mu = 1."""
    j, i = stretch * width ** 2, stretch ** 2 + 2 * width ** 2
    scale = j ** (-2 / 3)
    slope = 0.5 * np.exp(np.minimum(b * (scale * i - 3), 32))
    return (2 * slope * scale * (stretch - i / (3 * stretch)) + kappa * (j - 1) * width ** 2,
            2 * slope * scale * (width - i / (3 * width)) + kappa * (j - 1) * stretch * width)


def uniaxial(stretch, b):
    """Nominal stress over mu, and the width's stretch, of a bar whose sides are free; stretch: an array."""
    kappa = 2 * (1 + POISSON) / (3 * (1 - 2 * POISSON))
    low, high = np.full_like(stretch, 0.5), np.full_like(stretch, 2.0)
    for _ in range(60):
        middle = (low + high) / 2
        wide = derivatives(stretch, middle, b, kappa)[1] > 0
        low, high = np.where(wide, low, middle), np.where(wide, middle, high)
    width = (low + high) / 2
    return derivatives(stretch, width, b, kappa)[0], width


def fit(compression, force, height, radius):
    """(E in Pa, b, largest difference over the largest force) of a cylinder, mm and N, by least squares."""
    stretch, area = 1 - np.asarray(compression) / height, 1e-6 * np.pi * radius ** 2
    force = np.asarray(force)

    def at(b):
        shape = -area * uniaxial(stretch, b)[0]
        mu = shape @ force / (shape @ shape)
        return mu, np.linalg.norm(mu * shape - force), np.abs(mu * shape - force).max() / force.max()

    grid = np.linspace(0.05, 12, 120)
    for _ in range(4):
        best = min(range(len(grid)), key=lambda k: at(grid[k])[1])
        grid = np.linspace(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)], 40)
    b = min(grid, key=lambda value: at(value)[1])
    mu, _, worst = at(b)
    return 2 * mu * (1 + POISSON), float(b), float(worst)
