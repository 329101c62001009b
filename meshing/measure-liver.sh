#!/usr/bin/env bash
# Prints the table of meshing/TETRAHEDRA.md: surface and tetrahedra of the liver at five mesh sizes.
#   meshing/measure-liver.sh BUILD_FOLDER LIVER.inr.gz [OUTPUT_FOLDER]
set -euo pipefail
bin=$1/bin
image=$2
out=${3:-$(mktemp -d)}

# vertices wanted, triangles of the surface, Gaussian width in mm, largest edge inside in mm
sizes="200:270:3:100 1700:1350:1.5:9 5000:2950:1.5:6.4 20000:7900:1:3.8 100000:24000:1:2.17"

echo "| vertices wanted | triangles | kept | vertices | tetrahedra | least dihedral angle, degrees | radius ratio mean / least | distance to voxels mean / 95 % / largest, mm | surface, CPU s | tetrahedra, CPU s | memory, MB |"
echo "|---|---|---|---|---|---|---|---|---|---|---|"
for size in $sizes; do
  IFS=: read -r target triangles smooth edge <<<"$size"
  /usr/bin/env time -f "%U" -o "$out/surface.time" "$bin/palpate-surface" "$image" --labels 255 --smooth "$smooth" \
    --triangles "$triangles" -o "$out/liver-$target.ply" --report "$out/surface-$target.json" >"$out/log" 2>&1
  /usr/bin/env time -f "%U %M" -o "$out/mesh.time" "$bin/palpate-tetrahedra" "$out/liver-$target.ply" --region liver \
    --size "$edge" -o "$out/liver-$target.msh" --report "$out/mesh-$target.json" >>"$out/log" 2>&1
  /usr/bin/python3 - "$target" "$out" <<'PYTHON'
import json, sys
target, out = sys.argv[1:]
s = json.load(open(f"{out}/surface-{target}.json"))
m = json.load(open(f"{out}/mesh-{target}.json"))
d = s["distance_to_reference_mm"]
seconds, kilobytes = open(f"{out}/mesh.time").read().split()[-2:]
print(f"| {int(target):,} | {m['surface_triangles']['given']:,} | {m['surface_triangles']['kept']:,} | {m['vertices']:,} | "
      f"{m['tetrahedra']:,} | {m['min_dihedral_degrees']['value']:.1f} | {m['mean_radius_ratio']:.3f} / "
      f"{m['min_radius_ratio']['value']:.3f} | {d['mean']:.2f} / {d['p95']:.1f} / {d['most']:.1f} | "
      f"{float(open(f'{out}/surface.time').read().split()[-1]):.1f} | {float(seconds):.1f} | {int(kilobytes) // 1024} |")
PYTHON
done
