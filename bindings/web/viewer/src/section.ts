// A plane through the organ: what lies before it is not drawn, and the cut through the tetrahedra is drawn in its place.
import { BufferAttribute, BufferGeometry, Color, DoubleSide, type Material, Mesh as Object3, MeshBasicMaterial, MeshStandardMaterial, Plane, Vector3 } from "three";
import { colourOfField, roundUp } from "./colours";
import type { FieldOf, Frame, Mesh } from "./messages";

export type SectionAxis = "none" | "x" | "y" | "z";
export const SECTION_AXES: readonly SectionAxis[] = ["none", "x", "y", "z"];

const LIGHTER = 0.5; // of the organ's own colour towards PALE: the inside
const PALE = new Color("#f0b3a4");
// Regions after the largest one, over again where there are more.
const REGIONS = ["#6f8f4e", "#4f7fa8", "#b58a3a", "#7f6aa8", "#4f9a8f"].map((name) => new Color(name));

const LEAST = { displacement: 0.001, "von-mises": 10, pressure: 10 }; // m, Pa: a legend ends no lower, so that rounding has no colours

export class Section {
  readonly plane = new Plane();
  readonly cut: Object3<BufferGeometry, Material>;
  most = 0; // m or Pa: what the last colour of the legend stands for; 0: no field is shown
  private lit = new MeshStandardMaterial({ vertexColors: true, roughness: 0.8, side: DoubleSide, flatShading: true });
  private plain = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide }); // without light: its colours are those of the legend
  of: FieldOf = "none"; // the field that is shown
  area = 0; // m^2, of the cut
  private axis: SectionAxis = "none";
  private tetrahedra: Uint32Array<ArrayBufferLike> = new Uint32Array(0);
  private region: Int32Array<ArrayBufferLike> = new Int32Array(0);
  private low = new Vector3();
  private high = new Vector3();

  constructor(private tissue: readonly number[]) {
    this.cut = new Object3<BufferGeometry, Material>(new BufferGeometry(), this.lit);
    this.cut.frustumCulled = this.cut.visible = false;
  }

  open({ positions, tetrahedra, region }: Mesh) {
    this.tetrahedra = tetrahedra;
    this.region = byCount(region);
    this.low.setScalar(Infinity);
    this.high.setScalar(-Infinity);
    for (let n = 0; n < positions.length; n += 3) {
      this.low.min(new Vector3().fromArray(positions, n));
      this.high.max(new Vector3().fromArray(positions, n));
    }
    this.axis = "none";
  }

  // at: from 0 to 1 along the axis. What lies on the eye's side is not drawn. facing: the cosine between a direction and that to the eye.
  set(axis: SectionAxis, at: number, facing: (direction: [number, number, number]) => number) {
    this.axis = axis;
    const d = Math.max(0, SECTION_AXES.indexOf(axis) - 1), normal = new Vector3().setComponent(d, 1);
    if (facing(normal.toArray()) > 0) normal.negate();
    this.plane.set(normal, -normal.getComponent(d) * (this.low.getComponent(d) + at * (this.high.getComponent(d) - this.low.getComponent(d))));
  }

  get wanted() {
    return this.axis !== "none";
  }

  // The planes that clip what is drawn.
  get planes() {
    return this.cut.visible ? [this.plane] : [];
  }

  // positions, inside: of the surface's nodes and of the others, m. Without the others nothing is cut. field: of all nodes; null: the cut
  // shows the tissues.
  move(positions: Float32Array, inside: Float32Array, field: Frame["field"]) {
    this.cut.visible = this.wanted && inside.length > 0;
    this.area = 0;
    const surface = positions.length, place: number[] = [], colour: number[] = [], values: number[] = [];
    const known = this.cut.visible && field?.values.length === (surface + inside.length) / 3 ? field : null;
    if (!known || known.of !== this.of) this.most = 0;
    this.of = known?.of ?? "none";
    if (!this.cut.visible) return;
    const node = (n: number, into: Vector3) => (3 * n < surface ? into.fromArray(positions, 3 * n) : into.fromArray(inside, 3 * n - surface));
    const corner = [0, 1, 2, 3].map(() => new Vector3()), height = [0, 0, 0, 0];
    for (let t = 0; t < this.region.length; ++t) {
      let before = 0;
      for (let i = 0; i < 4; ++i) {
        height[i] = this.plane.distanceToPoint(node(this.tetrahedra[4 * t + i], corner[i]));
        before += height[i] < 0 ? 1 : 0;
      }
      if (before === 0 || before === 4) continue;
      const crossing: Vector3[] = [], low = [0, 1, 2, 3].filter((i) => height[i] < 0), high = [0, 1, 2, 3].filter((i) => height[i] >= 0);
      const valueAt: number[] = [];
      const cross = (a: number, b: number) => {
        const share = height[a] / (height[a] - height[b]);
        crossing.push(corner[a].clone().lerp(corner[b], share));
        if (known) valueAt.push((1 - share) * known.values[this.tetrahedra[4 * t + a]] + share * known.values[this.tetrahedra[4 * t + b]]);
      };
      // Three points of a triangle, or four in the order around a quadrilateral.
      if (low.length === 2) [[0, 0], [0, 1], [1, 1], [1, 0]].forEach(([a, b]) => cross(low[a], high[b]));
      else for (const a of low) for (const b of high) cross(a, b);
      const own = this.colourOf(this.region[t]);
      for (let i = 2; i < crossing.length; ++i) {
        const [a, b, c] = [crossing[0], crossing[i - 1], crossing[i]];
        if (known) values.push(valueAt[0], valueAt[i - 1], valueAt[i]);
        this.area += b.clone().sub(a).cross(c.clone().sub(a)).length() / 2;
        for (const point of [a, b, c]) {
          place.push(point.x, point.y, point.z);
          colour.push(own.r, own.g, own.b);
        }
      }
    }
    if (known) {
      this.most = scaleOf(values, this.most, LEAST[known.of as keyof typeof LEAST]);
      values.forEach((value, i) => colourOfField(value / this.most, known.of === "pressure", colour, 3 * i));
    }
    this.cut.material = known ? this.plain : this.lit;
    const { geometry } = this.cut;
    geometry.setAttribute("position", new BufferAttribute(Float32Array.from(place), 3));
    geometry.setAttribute("color", new BufferAttribute(Float32Array.from(colour), 3));
    geometry.computeVertexNormals();
  }

  private colourOf(rank: number): Color {
    if (rank > 0) return REGIONS[(rank - 1) % REGIONS.length];
    return new Color().setRGB(this.tissue[0], this.tissue[1], this.tissue[2]).lerp(PALE, LIGHTER);
  }
}

// The last colour's value: of the largest one, in steps of 1, 2, 5; it goes down where that is much below it, so that it stays while a tool moves.
function scaleOf(values: number[], before: number, least: number): number {
  let largest = least;
  for (const value of values) largest = Math.max(largest, Math.abs(value));
  return largest > before || largest < before / 4 ? roundUp(largest) : before;
}

// The rank of each tetrahedron's region, the one with the most tetrahedra first.
function byCount(region: Int32Array): Int32Array {
  const count = new Map<number, number>();
  for (const r of region) count.set(r, (count.get(r) ?? 0) + 1);
  const rank = new Map([...count].sort((a, b) => b[1] - a[1]).map(([r], i) => [r, i]));
  return region.map((r) => rank.get(r)!);
}
