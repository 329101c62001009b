// What the page draws of a bundle: its surface at rest, its inner mesh, and where it is held and touchable.
import type { Bundle } from "../../module/palpate.js";
import type { Mesh } from "./messages";

export function meshOf({ info, nodes, triangles, tetrahedra, region, fixed, touchable, foundation }: Bundle): Mesh {
  const held: number[] = [];
  for (let n = 0; n < info.surfaceNodeCount; ++n) if (fixed[3 * n] && fixed[3 * n + 1] && fixed[3 * n + 2]) held.push(n);
  const soft = Array.from({ length: foundation.length / 2 }, (_, t) => t).filter((t) => foundation[2 * t] > 0 || foundation[2 * t + 1] > 0);
  return {
    positions: Float32Array.from(nodes.subarray(0, 3 * info.surfaceNodeCount)), triangles: Uint32Array.from(triangles),
    tetrahedra: Uint32Array.from(info.hasInterior ? tetrahedra : []), region: Int32Array.from(info.hasInterior ? region : []),
    fixed: Int32Array.from(held), touchable: Int32Array.from(touchable),
    soft: Int32Array.from(soft), stiffness: Float64Array.from(soft, (t) => foundation[2 * t]),
  };
}

export function provenanceOf({ provenance }: Bundle): Record<string, unknown> {
  try {
    return JSON.parse(provenance);
  } catch {
    return {};
  }
}
