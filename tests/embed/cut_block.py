"""cut_block.py PALPATE_PRECOMPUTE BUNDLE [OPTIONS of palpate-precompute]: precomputes a block of 80 x 50 x 40 mm, held at x = 0, all of which
may be cut; its files lie beside it."""
import itertools
import pathlib
import subprocess
import sys

program, bundle = sys.argv[1], pathlib.Path(sys.argv[2])
CELLS, SIZE = (6, 4, 3), (80, 50, 40)  # mm

nodes = [[SIZE[d] * at[d] / CELLS[d] for d in range(3)] for at in itertools.product(*(range(n + 1) for n in CELLS))]
tetrahedra = []
for corner in itertools.product(*(range(n) for n in CELLS)):
    for order in itertools.permutations(range(3)):  # six tetrahedra: the ways along the edges of a cell
        at, way = list(corner), [corner]
        for axis in order:
            at[axis] += 1
            way.append(tuple(at))
        if order in ((0, 2, 1), (1, 0, 2), (2, 1, 0)):
            way[2], way[3] = way[3], way[2]
        tetrahedra.append([1 + (i * (CELLS[1] + 1) + j) * (CELLS[2] + 1) + k for i, j, k in way])

mesh, organ, boundary = (bundle.with_suffix(end) for end in (".msh", ".organ.toml", ".boundary.toml"))
lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "1", '3 1 "block"', "$EndPhysicalNames", "$Nodes", str(len(nodes))]
lines += ["%d %.17g %.17g %.17g" % (n, *at) for n, at in enumerate(nodes, 1)]
lines += ["$EndNodes", "$Elements", str(len(tetrahedra))]
lines += ["%d 4 2 1 1 %d %d %d %d" % (e, *of) for e, of in enumerate(tetrahedra, 1)] + ["$EndElements", ""]
mesh.write_text("\n".join(lines))
organ.write_text("""name = "block"
mesh_unit = "mm"
frame = "none"
element = "p1-anp"
[[region]]
name = "block"
young = { value = 5.4, unit = "kPa", source = "test" }
poisson = { value = 0.45, source = "test" }
""")
boundary.write_text("""name = "back"
[[fixed]]
dofs = "xyz"
select = { box = { min = [-1, -1, -1], max = [0.1, 100, 100] } }
[cut]
region = { box = { min = [-1, -1, -1], max = [100, 100, 100] }, where = "all" }
""")
subprocess.run([program, mesh, "--organ", organ, "--boundary", boundary, "-o", bundle, *sys.argv[3:]], check=True)
