#!/usr/bin/env python3
"""Writes the compression curves of this folder, at the three measured rates and at once, from the constants of the model that was fitted to the measurements.

Measured: swine brain cylinders of 30 mm diameter and 13 mm height, compressed between smooth plates (K. Miller and
K. Chinzei, Constitutive modelling of brain tissue: experiment and theory, J. Biomechanics 30, 1997). The points themselves
are not published as numbers; what is kept here is the paper's hyper-viscoelastic model with its constants, which fits the
measurements up to 30 % compression:

    T = int_0^t sum_ij C_ij(t - s) d/ds [ d/dlambda (J1 - 3)^i (J2 - 3)^j ] ds      nominal stress, incompressible
    C_ij(t) = C_ij0 (1 - sum_k g_k (1 - exp(-t / tau_k)))

The radial displacement of an incompressible cylinder that stays a cylinder is r (1 / sqrt(1 - x / h) - 1).
Usage: make_curves.py [FOLDER]      needs numpy
"""
import math
import os
import sys

import numpy as np

HEIGHT, RADIUS = 13.0, 15.0  # mm
C1, C2 = 263.0, 491.0  # Pa: C100 = C010, C200 = C020
G, TAU = (0.450, 0.365), (0.5, 50.0)  # -, s
RATES = (500.0, 5.0, 0.005)  # mm/min; infinite: at once, which nobody can measure
LARGEST, SPACING = 3.9, 0.05  # mm: 30 % compression


def elastic_stress(stretch):
    """Nominal stress of the instantaneous model, Pa."""
    j1, j2 = stretch**2 + 2 / stretch, 2 * stretch + 1 / stretch**2
    d1, d2 = 2 * stretch - 2 / stretch**2, 2 - 2 / stretch**3
    return C1 * (d1 + d2) + 2 * C2 * ((j1 - 3) * d1 + (j2 - 3) * d2)


def compression_stress(rate, steps_per_row=200):
    """Displacements (mm) and nominal compressive stress (Pa) at a constant rate (mm/min)."""
    rows = round(LARGEST / SPACING)
    displacement = np.linspace(0, LARGEST, rows * steps_per_row + 1)
    instantaneous = -elastic_stress(1 - displacement / HEIGHT)
    if math.isinf(rate):
        return displacement[::steps_per_row], instantaneous[::steps_per_row]
    dt = displacement[1] / (rate / 60)
    total = (1 - sum(G)) * instantaneous
    for g, tau in zip(G, TAU):
        # Exact for a stress that is linear in each step: the branch decays and gains the mean of the decay.
        decay = math.exp(-dt / tau)
        gain = g * (1 - decay) * tau / dt
        branch = np.zeros_like(instantaneous)
        for k, increment in enumerate(np.diff(instantaneous)):
            branch[k + 1] = decay * branch[k] + gain * increment
        total += branch
    return displacement[::steps_per_row], total[::steps_per_row]


def how(rate):
    return "at once" if math.isinf(rate) else "at %g mm/min" % rate


def curve_text(rate):
    area = math.pi * (RADIUS * 1e-3) ** 2
    displacement, stress = compression_stress(rate)
    lines = [
        "# Swine brain, cylinder of 30 mm diameter and 13 mm height, compressed %s." % how(rate),
        "# Source: Miller and Chinzei 1997, J. Biomechanics 30: their hyper-viscoelastic model of their measurements,",
        "#   C100 = C010 = 263 Pa, C200 = C020 = 491 Pa, g = 0.450 and 0.365, tau = 0.5 and 50 s; not measured points.",
        "# Radial: incompressible and homogeneous, 15 (1/sqrt(1 - x/13) - 1) mm. Written by make_curves.py.",
        "displacement_mm,force_N,radial_mm",
    ]
    for x, s in zip(displacement, stress):
        radial = RADIUS * (1 / math.sqrt(1 - x / HEIGHT) - 1)
        lines.append("%.2f,%.6f,%.6f" % (x, s * area, radial))
    return "\n".join(lines) + "\n"


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__))
    for rate in RATES + (math.inf,):
        name = "at-once" if math.isinf(rate) else "%g-mm-min" % rate
        with open(os.path.join(folder, "swine-brain-%s.csv" % name), "w") as out:
            out.write(curve_text(rate))


if __name__ == "__main__":
    main()
