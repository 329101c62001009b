#!/usr/bin/env python3
"""device.py -o FILE.png: a simulated device at organs of rising stiffness, as it is and through the virtual coupling.

Needs the Python package: PYTHONPATH=build/python. The device and the hand are those of tests/runtime/device_loop_test.cpp."""
import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import palpate  # noqa: E402

INK, PLAIN, COUPLED = "#1c2530", "#c2410c", "#0b6fa4"
MASS, DAMPING, TICK, HAND = 0.1, 0.5, 1e-3, 200.0  # kg, N s/m, s, N/m; one tick of delay
FLOOR = 1e-4  # N: less is drawn as this


def tick_of(hand_damping):
    """Position, velocity and constant force after a tick: the exact exponential."""
    rates = np.array([[0, 1, 0], [-HAND / MASS, -(DAMPING + hand_damping) / MASS, 1 / MASS], [0, 0, 0]]) * TICK / 1024
    term = total = np.eye(3)
    for i in range(1, 12):
        term = term @ rates / i
        total = total + term
    return np.linalg.matrix_power(total, 1024)


def press(stiffness, hand_damping, coupled, seconds=4.0):
    """The force on the device in each tick. The hand goes 5 mm into the organ in 0.1 s and stays."""
    step = tick_of(hand_damping)
    coupling = palpate.Coupling(palpate.Device(mass=MASS, damping=DAMPING, tick=TICK, force_limit=1e3, velocity_limit=1e3))
    x = v = late = organ = 0.0
    forces = []
    for k in range(int(seconds / TICK)):
        place = x
        if coupled:
            coupling.step((x, 0, 0), (organ, 0, 0))
            place = coupling.tool_position[0]
        organ = -stiffness * max(0.0, place)
        forces.append(coupling.device_force[0] if coupled else organ)
        target = 0.006 * min(1.0, k * TICK / 0.1) - 0.001
        x, v, _ = step @ (x, v, late + HAND * target)
        late = forces[-1]
        if abs(x) > 1:
            return np.array(forces)
    return np.array(forces)


def variation(forces):
    return max(FLOOR, min(100.0, np.ptp(forces[-500:])))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", required=True)
    output = parser.parse_args().o
    plt.rcParams.update({"font.size": 10, "text.color": INK, "axes.edgecolor": INK, "axes.labelcolor": INK})
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), width_ratios=(3, 2))
    stiffnesses = np.geomspace(30, 30000, 61)
    for hand_damping, line in ((2.0, "-"), (0.0, "--")):
        hand = "hand with 2 N s/m" if hand_damping else "hand without damping"
        for coupled, colour, name in ((False, PLAIN, "as it is"), (True, COUPLED, "coupled")):
            seen = [variation(press(k, hand_damping, coupled)) for k in stiffnesses]
            left.loglog(stiffnesses, seen, line, color=colour, label=f"{name}, {hand}")
        limit = (DAMPING + hand_damping) / (1.5 * TICK)
        left.axvline(limit, color=INK, linewidth=0.8, linestyle=":")
        left.text(limit * 0.93, 40, f"bound {limit:,.0f} N/m", rotation=90, ha="right", va="top", fontsize=9)
    left.set_xlabel("stiffness of the organ, N/m")
    left.set_ylabel("the force varies after 3.5 s by, N")
    left.set_ylim(FLOOR * 0.7, 150)
    left.set_yticks([1e-4, 1e-3, 1e-2, 1e-1, 1, 10, 100], ["0.0001\nor less", "0.001", "0.01", "0.1", "1", "10", "100\nor more"])
    left.legend(fontsize=8, loc="lower right", bbox_to_anchor=(1, 0.13), framealpha=0.95)
    for coupled, colour, name in ((False, PLAIN, "as it is"), (True, COUPLED, "coupled")):
        forces = -press(9000, 2.0, coupled, 0.6)
        right.plot(1e3 * TICK * np.arange(len(forces)), forces, color=colour, label=name, linewidth=1 if not coupled else 2)
    right.set_xlabel("ms since the hand began to push 5 mm")
    right.set_ylabel("force on the device, N")
    right.set_title("an organ of 9,000 N/m, hand with 2 N s/m", fontsize=10)
    right.legend(fontsize=9)
    figure.tight_layout()
    figure.savefig(output, dpi=110)


if __name__ == "__main__":
    main()
