// What palpate-accuracy measured (studies/accuracy): accuracy.json, read as its report reads it.
import type { Key } from "./words";

export interface ServedStudy {
  organ: string;
  boundary: string;
  address: string; // of the study's folder
  finer: string | null; // address of the organ's finer surface
  bundles: string[]; // of the study, that are still there
}

// A measured setting: a record of studies/accuracy/results.cpp.
export interface Setting {
  name: string;
  is_reference: boolean;
  shares_reference?: boolean; // the mesh, element and scene of the reference; studies of before do not say
  vertices: number;
  element: string;
  own_material: boolean;
  columns_everywhere: boolean;
  solver: string;
  storage: string;
  exercise: string;
  law: string;
  contact: string;
  contacts: number;
  force_error: number;
  force_error_worst: number;
  field_error: number;
  field_error_mm: number;
  reference_force_error: number | null;
  reference_field_error: number | null;
  touch_us: number;
  shape_us: number;
  precompute_s: number;
  precompute_GB: number;
  bundle_MB: number;
  bundle?: string; // its file in the study's folder; studies of before have none
}

export interface Study {
  organ: string;
  boundary: string;
  radius_mm: number;
  points: Setting[];
}

type Cost = "touch_us" | "shape_us" | "precompute_s" | "bundle_MB";
type Judged = "force_error" | "field_error";
export interface FrontAxes {
  title: Key;
  cost: Cost;
  costLabel: Key;
  error: Judged;
  errorLabel: Key;
  reference: "reference_force_error" | "reference_field_error";
}

const OF_FORCE = { error: "force_error", errorLabel: "accuracy.axis.force", reference: "reference_force_error" } as const;
export const FRONTS: FrontAxes[] = [
  { title: "accuracy.front.touch", cost: "touch_us", costLabel: "accuracy.axis.touch", ...OF_FORCE },
  { title: "accuracy.front.shape", cost: "shape_us", costLabel: "accuracy.axis.shape", error: "field_error", errorLabel: "accuracy.axis.displacement", reference: "reference_field_error" },
  { title: "accuracy.front.precompute", cost: "precompute_s", costLabel: "accuracy.axis.precompute", ...OF_FORCE },
  { title: "accuracy.front.bundle", cost: "bundle_MB", costLabel: "accuracy.axis.bundle", ...OF_FORCE },
];

// The settings that a user could bake: can_be_chosen of studies/accuracy/choose.h.
export const choices = ({ points }: Study) => points.filter((p) => p.own_material && p.columns_everywhere && p.exercise === "press" && p.solver === "auto" &&
  p.contacts === 1 && p.law === "sticking" && p.storage !== "f64" && !p.is_reference && !p.shares_reference);

// The reference's own error, estimated; null where it is unknown.
export function errorOfReference({ points }: Study, { reference }: FrontAxes): number | null {
  const own = points.find((p) => p.is_reference && p.own_material && p.exercise === "press" && p.contacts === 1);
  return own?.[reference] ?? null;
}

// Those that no other one beats in both values, from the cheapest to the most accurate.
export function paretoFront<T>(of: T[], cost: (one: T) => number, error: (one: T) => number): T[] {
  const front: T[] = [];
  for (const one of [...of].sort((a, b) => cost(a) - cost(b) || error(a) - error(b)))
    if (!front.length || error(one) < error(front[front.length - 1])) front.push(one);
  return front;
}
