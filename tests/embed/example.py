import sys

import numpy as np
import palpate

bundle = palpate.Bundle(sys.argv[1])
scene = palpate.Scene(bundle)
contacts = scene.make_contacts()

# A probe of 2 mm radius meets the middle of a triangle, along its normal: from 5 mm above the surface to 5 mm below.
triangle = bundle.triangles[np.isin(bundle.triangles, bundle.touchable).all(axis=1)][0]
a, b, c = bundle.nodes[triangle]
normal = np.cross(b - a, c - a)
normal /= np.linalg.norm(normal)
probe = palpate.Tool((a + b + c) / 3, disc_radius=0.002)
start = probe.points.copy()
for ms in range(1001):
    probe.points[:] = start + normal * (0.005 - 1e-5 * ms)
    flags = scene.touch([probe], 0.001, contacts)
    if ms % 100 == 0:
        print(f"{ms:4d} ms  {contacts.force[0] @ normal:7.4f} N  flags {int(flags)}")

positions = np.empty((scene.shape_node_count, 3), np.float32)
scene.shape(contacts, positions=positions)
moved = np.linalg.norm(positions - bundle.nodes[: len(positions)], axis=1)
print(f"{len(positions)} nodes drawn, the most displaced by {moved.max() * 1e3:.2f} mm")
