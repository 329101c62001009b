import sys

import palpate

scene = palpate.Scene(palpate.Bundle(sys.argv[1]))
depths, forces = scene.plot_press("foremost", 0.005, "press.png", disc_radius=0.005)  # m; a file for the plot
print(f"{forces[-1]:.4f} N at {depths[-1] * 1e3:.0f} mm")
print(scene.explain())
