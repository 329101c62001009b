// Up to which depth of a push linear elasticity is right: as palpate-run's warning has it (programs/player/scene_warnings.h).
import { boxOf } from "./geometry";
import type { Key } from "./words";

const NOT_MEASURED = 0.01; // m: docs/accuracy.md, "Linear elasticity itself"
const LARGEST_SHARE = 0.1; // of the organ's smallest extent

export interface LinearLimit {
  depth: number; // m
  rule: Key; // by which it is: the bundle's own accuracy_linear_limit_mm, where the force is 5 % off, or another
}

// organ: positions at rest, m.
export function linearLimit(provenance: Record<string, unknown>, organ: Float32Array): LinearLimit {
  const { low, high } = boxOf(organ);
  const share = LARGEST_SHARE * Math.min(...high.map((x, d) => x - low[d])), own = Number(provenance.accuracy_linear_limit_mm) / 1000;
  const limit = own > 0 ? own : NOT_MEASURED;
  if (share < limit) return { depth: share, rule: "trust.thin" };
  return { depth: limit, rule: own > 0 ? "trust.measured" : "trust.not-measured" };
}
