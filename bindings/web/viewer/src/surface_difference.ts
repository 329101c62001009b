// The difference between two displacements of one organ's surface, which two bundles may have cut into different triangles.
import { Triangle, Vector3 } from "three";
import { nearestIndex } from "./geometry";

export interface Surface {
  positions: Float32Array; // rest, [node][3] m
  triangles: Uint32Array;
}

// For each node of one surface the point of another one that is nearest at rest: three nodes and their shares.
export class NearestPoints {
  readonly farthest: number; // m, between a node and its nearest point
  private nodes: Uint32Array;
  private shares: Float32Array;

  // Cost: the product of both numbers of nodes.
  constructor(private of: Surface, on: Surface) {
    const count = of.positions.length / 3, around = trianglesAround(on);
    this.nodes = new Uint32Array(3 * count);
    this.shares = new Float32Array(3 * count);
    const triangle = new Triangle(), point = new Vector3(), nearest = new Vector3(), shares = new Vector3();
    let farthest = 0;
    for (let n = 0; n < count; ++n) {
      point.fromArray(of.positions, 3 * n);
      let least = Infinity;
      for (const t of around[nearestIndex(point.toArray(), on.positions)]) {
        const corners = on.triangles.subarray(3 * t, 3 * t + 3);
        triangle.set(...([...corners].map((corner) => new Vector3().fromArray(on.positions, 3 * corner)) as [Vector3, Vector3, Vector3]));
        const away = triangle.closestPointToPoint(point, nearest).distanceTo(point);
        if (away >= least) continue;
        least = away;
        triangle.getBarycoord(nearest, shares);
        this.nodes.set(corners, 3 * n);
        this.shares.set(shares.toArray(), 3 * n);
      }
      farthest = Math.max(farthest, least);
    }
    this.farthest = farthest;
  }

  // own: positions of the nodes, others: of the other surface's, both [node][3] m, and others at rest. The largest difference of the
  // two displacements and the root of its mean square, m.
  difference(own: Float32Array, others: Float32Array, othersAtRest: Float32Array): { largest: number; rms: number } {
    const count = own.length / 3, { positions: rest } = this.of;
    let largest = 0, sum = 0;
    for (let n = 0; n < count; ++n) {
      let square = 0;
      for (let d = 0; d < 3; ++d) {
        let other = 0;
        for (let i = 3 * n; i < 3 * n + 3; ++i) other += this.shares[i] * (others[3 * this.nodes[i] + d] - othersAtRest[3 * this.nodes[i] + d]);
        square += (other - (own[3 * n + d] - rest[3 * n + d])) ** 2;
      }
      largest = Math.max(largest, Math.sqrt(square));
      sum += square;
    }
    return { largest, rms: Math.sqrt(sum / count) };
  }
}

function trianglesAround({ positions, triangles }: Surface): number[][] {
  const around: number[][] = Array.from({ length: positions.length / 3 }, () => []);
  triangles.forEach((node, i) => around[node].push(Math.floor(i / 3)));
  return around;
}
