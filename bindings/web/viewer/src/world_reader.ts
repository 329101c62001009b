// Reads a scene file of several organs, which palpate-run plays. What the page cannot play is refused with the key's name.
import { pointsOf } from "./capsule";
import type { Pose } from "../../module/palpate.js";
import { MOST_TOOLS, TOUCH_HZ, type PageEffects, type Vector } from "./messages";
import { flatMesh, readObstacleMesh, type ObstacleMesh } from "./obstacle_mesh";
import { LONGEST_PATH, rowsOfFile } from "./path_files";
import { checkTimes, isRow, parsed, pathRows, playsAtPageRates, ratesOf, readEffects, refuseOthers, shownAs, table, timeSpans, unitOf, type Table } from "./scene_reader";
import { SIDES, type SceneBlade, type SceneGrasp, type SceneGrip, type SceneLink, type SceneLoad, type SceneMotion, type SceneNeedle, type SceneObstacle, type SceneOrgan, type ScenePlace, type SceneTool, type WorldScene } from "./world_scene";
import { sineCosine } from "./sine";
import { word } from "./words";

const MOST_PAIRS = 1000, MOST_FRICTION = 100, MOST_POINTS = 100_000, MOST_NODES = 3000, MOST_FORCE = 1e6, MOST_NEEDLE = 0.01, MOST_LINKS = 1000, MOST_LOADS = 4, MOST_OBSTACLES = 16, MOST_OBSTACLE_NODES = 2048, MOST_BLADES = 4, MOST_TOUGHNESS = 1e6, MOST_SHEAR = 1e6, MOST_SAMPLES = 65_536; // of palpate.h and palpate_world.h
const TOP = ["name", "unit", "csv_unit", "effects", "relaxation", "rate", "limits", "world", "organ", "motion", "load", "obstacle", "tool", "link"];
// displacement: beyond it palpate-run warns; it changes nothing that is computed.
const OF_LIMITS = ["points", "contact_nodes", "needle_places", "obstacle_nodes", "force", "force_slew", "tool_speed", "release_distance", "operations", "displacement", "crossings_calls", "crossings_operations", "cut_nodes", "cut_rank", "cut_operations", "cut_points", "cut_lips", "cut_rebase"];
const OF_ORGAN = ["name", "bundle", "position", "turn", "effects", "relaxation"];
const OF_MOTION = ["name", "organ", "sine", "amounts", "amounts_csv"];
const OF_LOAD = ["name", "organ", "near", "at", "radius", "force", "forces", "traction", "tractions", "frame"];
const OF_OBSTACLE = ["name", "organs", "kind", "size", "radius", "file", "unit", "normal", "position", "path", "path_csv", "turn", "friction", "depth"];
const OF_BLADE = ["name", "edge", "position", "path", "path_csv", "turn", "cuts", "toughness", "direction", "friction", "width"];
const OF_TOOL = ["name", "organ", "points", "capsule", "path", "path_csv", "turn", "at", "near", "depth", "grip", "hold", "disc_radius", "friction", "away", "grasp", "needle"];
const OF_CAPSULE = ["radius", "length", "axis", "samples"], OF_GRIP = ["nearest", "box", "axes"];
const OF_GRASP = ["near", "opposite", "radius", "friction", "clamp_force", "closing", "closed"];
const OF_NEEDLE = ["entry", "direction", "radius", "friction", "puncture_force", "cutting_force", "spacing"];
const OF_LINK = ["name", "kind", "organ", "organs", "places", "world", "rest_length", "rest_lengths", "stiffness", "stiffnesses", "breaking_force", "radius"];
const OBSTACLE_KINDS = ["rectangle", "disc", "mesh"] as const;
const KINDS = ["thread", "spring", "clip"] as const;

const MOST_TOUCHES = LONGEST_PATH * TOUCH_HZ; // of a scene: their forces are kept
const OWN_CHOICES = { collision: ["off"], shape: ["off"] }; // of effects, beside those of the page's own tools

// The text or the bytes of a file that a scene names, as the scene names it; null: it is not there.
export type SceneFiles = (name: string) => string | Uint8Array | null;

// The CSV files and the meshes that a scene names.
export function filesOfScene(text: string): string[] {
  const scene = parsed(text), named = (key: string, of: string) => listOf(scene[of]).map((one) => table(one, of)[key]);
  return [...named("path_csv", "tool"), ...named("amounts_csv", "motion"), ...named("path_csv", "obstacle"), ...named("path_csv", "blade"), ...named("file", "obstacle")].filter((name) => typeof name === "string");
}

// Throws an Error that names the key.
export function readWorld(text: string, files: SceneFiles): WorldScene {
  const scene = parsed(text);
  if (!Array.isArray(scene.organ)) throw new Error(word("world.one-organ"));
  return worldOf(scene, files);
}

// Of a tool or a scene of one organ: what the page's own tools, which press one point each, cannot do.
const BEYOND_POINTS = ["path_csv", "capsule", "turn", "at", "near", "depth", "grip", "grasp", "needle"], BEYOND_TOOLS = ["link", "motion", "load", "obstacle", "blade", "limits"];

// A scene of one organ that the page's own tools cannot play, as a world of that organ; null: another scene.
export function readOwn(text: string, organ: string, files: SceneFiles): WorldScene | null {
  const { bundle, ...scene } = parsed(text), tools = listOf(scene.tool).map((tool) => table(tool, "tool"));
  const isBeyond = (tool: Table) => BEYOND_POINTS.some((key) => key in tool) || listOf(tool.points).length > 1;
  if (scene.organ !== undefined || !(BEYOND_TOOLS.some((key) => key in scene) || tools.some(isBeyond) || !playsAtPageRates(scene))) return null;
  return worldOf({ ...scene, organ: [{ name: organ }] }, files, ["blade"]);
}

// more: keys that only a scene of one organ has here.
function worldOf(scene: Table & { organ?: unknown }, files: SceneFiles, more: string[] = []): WorldScene {
  const unit = unitOf(scene), given = scene.organ as Table[];
  refuseOthers(word("scene.itself"), scene, [...TOP, ...more]);
  const rates = ratesOf(scene), world = table(scene.world, "world"), limits = table(scene.limits, "limits"), names = given.map((organ, k) => nameOf(organ, `[[organ]] ${k + 1}`));
  refuseOthers("[world]", world, ["pairs", "friction"]);
  refuseOthers("[limits]", limits, OF_LIMITS);
  const twice = names.find((name, k) => names.indexOf(name) < k);
  if (twice !== undefined) throw new Error(word("world.same-name", { name: twice }));
  const motions = listOf(scene.motion).map((motion, m) => readMotion(table(motion, "motion"), `[[motion]] ${m + 1}`, names, files));
  const loads = listOf(scene.load).map((load, l) => readLoad(table(load, "load"), `[[load]] ${l + 1}`, names, unit));
  names.forEach((name, k) => {
    if (loads.filter(({ organ }) => organ === k).length > MOST_LOADS) throw new Error(word("world.many-loads", { most: MOST_LOADS, organ: name }));
  });
  const obstacles = listOf(scene.obstacle).map((obstacle, o) => readObstacle(table(obstacle, "obstacle"), `[[obstacle]] ${o + 1}`, names, unit, files));
  if (obstacles.length > MOST_OBSTACLES) throw new Error(word("world.many-obstacles", { most: MOST_OBSTACLES }));
  const blades = readBlades(scene, unit, files);
  const tools = listOf(scene.tool).map((tool, t) => readTool(table(tool, "tool"), `[[tool]] ${t + 1}`, names, unit, files));
  if (tools.length > MOST_TOOLS) throw new Error(word("scene.many-tools", { most: MOST_TOOLS }));
  const links = listOf(scene.link).map((link, l) => readLink(table(link, "link"), `[[link]] ${l + 1}`, names, unit));
  const pairs = wholeOf(world, "pairs", "[world]", MOST_PAIRS) ?? 0, friction = numberOf(world, "friction", "[world]", MOST_FRICTION) ?? 0;
  if (friction > 0 && pairs === 0) throw new Error(word("world.friction-alone"));
  const isWide = (k: number) => links.some(({ radius, isBetween, organs }) => radius && !isBetween && organs[0] === k);
  const organs = given.map((organ, k) => readOrgan(scene, organ, names[k], unit, {
    touch: pairs > 0, moves: motions.some((motion) => motion.organ === k), bears: loads.some((load) => load.organ === k), held: obstacles.some((obstacle) => obstacle.organs.includes(k)), cut: blades.length > 0,
    disc: !tools.length || tools.some(({ discRadius, grasp, organ: of }) => discRadius > 0 || (grasp && of === k)) || isWide(k),
  }));
  const touches = durationOf({ tools, motions, loads, obstacles, blades }) * rates.touch;
  if (touches > MOST_TOUCHES) throw new Error(word("scene.touches", { most: MOST_TOUCHES, found: Math.ceil(touches) }));
  return {
    name: String(scene.name ?? ""), unit, rates, pairs, friction, motions, loads, obstacles, blades, tools, links,
    forceLimit: numberOf(limits, "force", "[limits]"), forceSlew: numberOf(limits, "force_slew", "[limits]"),
    maxPoints: wholeOf(limits, "points", "[limits]", MOST_POINTS), maxContactNodes: wholeOf(limits, "contact_nodes", "[limits]", MOST_NODES), needlePlaces: wholeOf(limits, "needle_places", "[limits]", 64),
    obstacleNodes: wholeOf(limits, "obstacle_nodes", "[limits]", MOST_OBSTACLE_NODES), cutPoints: wholeOf(limits, "cut_points", "[limits]"), cutLips: wholeOf(limits, "cut_lips", "[limits]"),
    organs: organs.map((organ) => ({ ...organ, effects: { ...organ.effects, ...limitsOf(limits) } })),
  };
}

// s, to the last row of a tool, a motion, a load, an obstacle or a blade.
export function durationOf({ tools, motions, loads, obstacles, blades }: Pick<WorldScene, "tools" | "motions" | "loads" | "obstacles" | "blades">): number {
  const ofTools = tools.flatMap(({ path, turn, place, grasp }) => [path, turn, place?.depth, grasp?.closing]), ofPoses = [...obstacles, ...blades].flatMap(({ path, turn }) => [path, turn]), cuts = blades.map((blade) => blade.cuts.at(-1)?.[1] ?? 0);
  return Math.max(0, ...cuts, ...[...ofTools, ...ofPoses, ...motions.map(({ rows }) => rows), ...loads.map(({ rows }) => rows)].map((rows) => rows?.at(-1)?.[0] ?? 0));
}

const listOf = (given: unknown): unknown[] => (Array.isArray(given) ? given : []);

function limitsOf(limits: Table): PageEffects {
  const number = (key: string) => numberOf(limits, key, "[limits]");
  const all = {
    forceLimit: number("force"), forceSlew: number("force_slew"), maxToolSpeed: number("tool_speed"),
    releaseDistance: number("release_distance"), maxOperations: wholeOf(limits, "operations", "[limits]"), crossingsCalls: wholeOf(limits, "crossings_calls", "[limits]"), crossingsOperations: wholeOf(limits, "crossings_operations", "[limits]"),
    cutNodes: wholeOf(limits, "cut_nodes", "[limits]"), cutRank: wholeOf(limits, "cut_rank", "[limits]"), cutOperations: wholeOf(limits, "cut_operations", "[limits]"), cutPoints: wholeOf(limits, "cut_points", "[limits]"), cutLips: wholeOf(limits, "cut_lips", "[limits]"), cutRebase: wholeOf(limits, "cut_rebase", "[limits]"),
  };
  return Object.fromEntries(Object.entries(all).filter(([, value]) => value !== undefined));
}

// Of an [[organ]]: why its contact and collision are other ones than the defaults.
interface Needs {
  touch: boolean; // it presses others
  moves: boolean; // motions move it
  bears: boolean; // loads act on it
  held: boolean; // obstacles hold it off
  cut: boolean; // blades cut it
  disc: boolean; // a disc or jaws touch it
}

function readOrgan(scene: Table, given: Table, name: string, unit: number, needs: Needs): SceneOrgan {
  const where = `[[organ]] ${name}`;
  refuseOthers(where, given, OF_ORGAN);
  const chosen = { ...table(scene.effects, "effects"), ...table(given.effects, "effects") };
  const relaxation = table(given.relaxation ?? scene.relaxation, "relaxation"), effects = readEffects(chosen, relaxation, needs.disc, OWN_CHOICES);
  if (needs.cut && chosen.cut === false) throw new Error(word("scene.cut-off"));
  if (needs.cut) effects.cut = true;
  if (chosen.collision === undefined && (needs.touch || needs.moves || needs.bears || needs.held || needs.cut)) effects.collision = "deformed";
  return {
    name, bundle: given.bundle === undefined ? null : String(given.bundle), pose: poseOf(given, where, unit),
    effects: { ...effects, shape: "surface", motions: needs.moves }, // the page draws surfaces
  };
}

function poseOf(given: Table, where: string, unit: number): Pose {
  const position = vectorOf(given, "position", where, unit), turn = vectorOf(given, "turn", where, Math.PI / 180) ?? [0, 0, 0];
  const angle = Math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]), half = sineCosine(angle / 2);
  return {
    ...(position ? { position } : {}),
    ...(angle > 0 ? { orientation: [half.cosine, ...turn.map((x) => (half.sine / angle) * x)] } : {}),
  };
}

function readMotion(given: Table, where: string, organs: string[], files: SceneFiles): SceneMotion {
  refuseOthers(where, given, OF_MOTION);
  const name = nameOf(given, where), organ = organOf(given, where, organs);
  if (["sine", "amounts", "amounts_csv"].filter((key) => key in given).length !== 1) throw new Error(word("world.motion", { where }));
  if (given.sine === undefined) return { name, organ, rows: given.amounts === undefined ? fileRows(given, "amounts_csv", where, 2, files) : rowsOf(given, "amounts", where)!, sine: null };
  const sine = table(given.sine, `${where} sine`), [amplitude, period, mean] = ["amplitude", "period", "mean"].map((key) => Number(sine[key] ?? (key === "mean" ? 0 : NaN)));
  refuseOthers(`${where} sine`, sine, ["amplitude", "period", "mean"]);
  if (!Number.isFinite(amplitude) || !(period > 0) || !Number.isFinite(mean)) throw new Error(word("world.sine", { where, found: shownAs(given.sine) }));
  return { name, organ, rows: null, sine: { amplitude, period, mean } };
}

function readObstacle(given: Table, where: string, organs: string[], unit: number, files: SceneFiles): SceneObstacle {
  refuseOthers(where, given, OF_OBSTACLE);
  const kind = OBSTACLE_KINDS.find((one) => one === given.kind), normal = vectorOf(given, "normal", where, 1), radius = numberOf(given, "radius", where);
  const size = given.size as number[] | undefined, isRectangle = isRow(size, 2) && size[0] > 0 && size[1] > 0;
  const isWhole = { rectangle: isRectangle, disc: !!radius, mesh: typeof given.file === "string" && normal === null }[kind!];
  const ways = ["position", "path", "path_csv"].filter((key) => key in given);
  if (!kind || !isWhole || ways.length > 1 || normal?.every((x) => x === 0)) throw new Error(word("world.obstacle", { where, found: shownAs(given) }));
  const named = given.organs === undefined ? organs : (given.organs as unknown[]);
  if (!Array.isArray(named) || !named.length) throw new Error(word("world.organ", { where, organs: organs.join(", "), found: shownAs(named) }));
  const path = given.path !== undefined ? pathRows(given.path, where) : given.path_csv !== undefined ? fileRows(given, "path_csv", where, 4, files) : null;
  const both: [number, number] = isRectangle ? [unit * size[0], unit * size[1]] : [unit * (radius ?? 0), 0], depth = numberOf(given, "depth", where);
  const surface = kind === "mesh" ? meshOfFile(given, where, given.unit === undefined ? unit : unitOf(given), files) : flatMesh(kind, both);
  return {
    name: nameOf(given, where), kind, organs: named.map((organ) => organOf({ organ }, where, organs)), size: both, ...surface, normal: normal ?? [0, 0, 1],
    path: path ? inMetres(path, unit) : [[0, ...(vectorOf(given, "position", where, unit) ?? [0, 0, 0])]], turn: given.turn === undefined ? [] : pathRows(given.turn, where, "turn"),
    friction: numberOf(given, "friction", where, MOST_FRICTION) ?? 0, depth: depth && unit * depth,
  };
}

function readBlades(scene: Table, unit: number, files: SceneFiles): SceneBlade[] {
  const blades = listOf(scene.blade).map((blade, b) => readBlade(table(blade, "blade"), `[[blade]] ${b + 1}`, unit, files));
  if (blades.length > MOST_BLADES) throw new Error(word("world.many-blades", { most: MOST_BLADES }));
  return blades;
}

function readBlade(given: Table, where: string, unit: number, files: SceneFiles): SceneBlade {
  refuseOthers(where, given, OF_BLADE);
  const edge = given.edge as number[][], direction = vectorOf(given, "direction", where, 1), toughness = numberOf(given, "toughness", where, MOST_TOUGHNESS) ?? 0;
  const isEdge = Array.isArray(edge) && edge.length >= 2 && edge.length <= 16 && edge.every((point) => isRow(point, 3));
  const ways = ["position", "path", "path_csv"].filter((key) => key in given), size = direction ? Math.hypot(...direction) : 0;
  const friction = numberOf(given, "friction", where, MOST_SHEAR) ?? 0, width = numberOf(given, "width", where, 1 / unit) ?? 0;
  if (!isEdge || ways.length > 1 || toughness > 0 !== size > 0 || friction > 0 !== width > 0 || (friction > 0 && !toughness)) throw new Error(word("world.blade", { where, found: shownAs(given) }));
  const path = given.path !== undefined ? pathRows(given.path, where) : given.path_csv !== undefined ? fileRows(given, "path_csv", where, 4, files) : null;
  return {
    name: nameOf(given, where), edge: edge.map((point) => point.map((x) => unit * x) as Vector), path: path ? inMetres(path, unit) : [[0, ...(vectorOf(given, "position", where, unit) ?? [0, 0, 0])]],
    turn: given.turn === undefined ? null : pathRows(given.turn, where, "turn"), cuts: timeSpans(given.cuts, `${where} cuts`), toughness, friction, width: unit * width,
    direction: direction && (direction.map((x) => x / size) as Vector),
  };
}

function meshOfFile(given: Table, where: string, unit: number, files: SceneFiles): ObstacleMesh {
  const name = String(given.file), file = files(name);
  if (file === null) throw new Error(word("world.no-csv", { where, key: "file", name }));
  return readObstacleMesh(name, typeof file === "string" ? new TextEncoder().encode(file) : file, unit);
}

function readLoad(given: Table, where: string, organs: string[], unit: number): SceneLoad {
  refuseOthers(where, given, OF_LOAD);
  const near = vectorOf(given, "near", where, unit), at = SIDES.find((side) => side === given.at) ?? null, radius = numberOf(given, "radius", where);
  const ways = ["force", "forces", "traction", "tractions"].filter((key) => given[key] !== undefined), [way] = ways, frame = given.frame ?? "world";
  if (given.at !== undefined && !at) throw new Error(word("world.at", { where, expected: SIDES.join(", "), found: shownAs(given.at) }));
  if ((near === null) === (at === null) || !radius || ways.length !== 1 || (frame !== "world" && frame !== "organ")) throw new Error(word("world.load", { where, found: shownAs(given) }));
  const rows = way.endsWith("s") ? pathRows(given[way], where, way) : [[0, ...vectorOf(given, way, where, 1)!]];
  return { name: nameOf(given, where), organ: organOf(given, where, organs), near, at, radius: unit * radius, rows, perArea: way.startsWith("traction"), inWorld: frame === "world" };
}

function readTool(given: Table, where: string, organs: string[], unit: number, files: SceneFiles): SceneTool {
  refuseOthers(where, given, OF_TOOL);
  const grasp = given.grasp === undefined ? null : readGrasp(table(given.grasp, "grasp"), `${where} grasp`, unit);
  const needle = given.needle === undefined ? null : readNeedle(table(given.needle, "needle"), `${where} needle`, unit, given.near !== undefined || given.at !== undefined);
  const place = readPlace(given, where, unit), grips = listOf(given.grip).map((grip, g) => readGrip(table(grip, "grip"), `${where} grip ${g + 1}`, unit));
  const own = (given.points ?? []) as number[][], turn = given.turn === undefined ? null : pathRows(given.turn, where, "turn");
  if (!Array.isArray(own) || !own.every((point) => isRow(point, 3))) throw new Error(word("world.points", { where, found: shownAs(given.points) }));
  const points = given.capsule === undefined ? own : [...own, ...readCapsule(table(given.capsule, "capsule"), `${where} capsule`)];
  if (!points.length && !grasp && !needle && !grips.length) throw new Error(word("world.points", { where, found: shownAs(given.points) }));
  return {
    name: String(given.name ?? ""), organ: place || grasp || needle || grips.length ? organOf(given, where, organs) : 0, points: points.map((point) => point.map((x) => unit * x) as Vector),
    path: place ? null : inMetres(given.path_csv === undefined ? pathRows(given.path, where) : fileRows(given, "path_csv", where, 4, files), unit), turn, place, grips,
    hold: given.hold === true, discRadius: unit * (numberOf(given, "disc_radius", where) ?? 0), friction: numberOf(given, "friction", where, MOST_FRICTION) ?? 0,
    away: timeSpans(given.away, `${where} away`), grasp, needle,
  };
}

// null: the tool has a path.
function readPlace(given: Table, where: string, unit: number): ScenePlace | null {
  const near = vectorOf(given, "near", where, unit), depth = rowsOf(given, "depth", where), at = SIDES.find((side) => side === given.at) ?? null;
  if (given.at !== undefined && !at) throw new Error(word("world.at", { where, expected: SIDES.join(", "), found: shownAs(given.at) }));
  const places = [near, at, given.path, given.path_csv].filter((one) => one !== null && one !== undefined).length, hasPlace = near !== null || at !== null;
  if (places > 1 || hasPlace !== (depth !== null)) throw new Error(word("world.place", { where }));
  return hasPlace ? { near, at, depth: inMetres(depth!, unit) } : null;
}

// Its points, in the file's unit.
function readCapsule(given: Table, where: string): Vector[] {
  refuseOthers(where, given, OF_CAPSULE);
  const radius = numberOf(given, "radius", where), length = numberOf(given, "length", where), axis = vectorOf(given, "axis", where, 1), samples = wholeOf(given, "samples", where, MOST_SAMPLES);
  const size = axis ? Math.hypot(...axis) : 0;
  if (!radius || !length || !(size > 0) || !(samples! >= 2)) throw new Error(word("world.capsule", { where, found: shownAs(given) }));
  return pointsOf({ radius, length, axis: axis!.map((x) => x / size) as Vector, samples: samples! });
}

function readGrip(given: Table, where: string, unit: number): SceneGrip {
  refuseOthers(where, given, OF_GRIP);
  const nearest = vectorOf(given, "nearest", where, unit), box = table(given.box, "box"), [min, max] = ["min", "max"].map((key) => vectorOf(box, key, `${where} box`, unit));
  const letters = given.axes === undefined ? "xyz" : String(given.axes), axes = [...letters].reduce((bits, letter) => bits | (1 << "xyz".indexOf(letter)), 0);
  if ((nearest === null) === (given.box === undefined) || (given.box !== undefined && !(min && max)) || !/^(?!.*(.).*\1)[xyz]+$/.test(letters)) throw new Error(word("world.grip", { where, found: shownAs(given) }));
  return { nearest, box: min && max ? [min, max] : null, axes };
}

// hasPlace: of the tool, where the needle enters if it has no entry.
function readNeedle(given: Table, where: string, unit: number, hasPlace: boolean): SceneNeedle {
  refuseOthers(where, given, OF_NEEDLE);
  const entry = vectorOf(given, "entry", where, unit), direction = vectorOf(given, "direction", where, 1), length = direction && Math.hypot(...direction);
  const radius = unit * (numberOf(given, "radius", where) ?? 0), spacing = numberOf(given, "spacing", where);
  if ((entry === null) !== hasPlace || !(radius > 0 && radius <= MOST_NEEDLE) || length === 0) throw new Error(word("world.needle", { where, found: shownAs(given) }));
  return {
    entry, direction: direction && (direction.map((x) => x / length!) as Vector), radius, friction: numberOf(given, "friction", where, MOST_FORCE) ?? 0,
    punctureForce: numberOf(given, "puncture_force", where, MOST_FORCE) ?? 0, cuttingForce: numberOf(given, "cutting_force", where, MOST_FORCE) ?? 0,
    spacing: spacing && unit * spacing,
  };
}

function readLink(given: Table, where: string, organs: string[], unit: number): SceneLink {
  refuseOthers(where, given, OF_LINK);
  const places = (given.places ?? []) as number[][], kind = KINDS.find((one) => one === given.kind), world = vectorOf(given, "world", where, unit), isBetween = given.organs !== undefined;
  const ends = Array.isArray(places) && places.every((place) => isRow(place, 3)) ? places.length + (world ? 1 : 0) : 0, radius = numberOf(given, "radius", where);
  if (!kind || ends < 2 || (ends > 2 && kind !== "thread") || ends > MOST_LINKS) throw new Error(word("world.link", { where, found: shownAs(given) }));
  const named = isBetween ? (given.organs as unknown[]) : places.map(() => given.organ);
  if (!Array.isArray(named) || named.length !== places.length) throw new Error(word("world.organs-of", { where, count: places.length, found: shownAs(named) }));
  const number = (key: string, many: string) => (given[many] === undefined && given[key] !== undefined ? [[0, numberOf(given, key, where)!]] : rowsOf(given, many, where));
  const length = number("rest_length", "rest_lengths");
  return {
    name: nameOf(given, where), kind, isBetween, world, organs: named.map((organ) => organOf({ organ }, where, organs)), places: places.map((place) => place.map((x) => unit * x) as Vector),
    restLength: length && inMetres(length, unit), stiffness: number("stiffness", "stiffnesses"), breakingForce: numberOf(given, "breaking_force", where), radius: radius && unit * radius,
  };
}

function readGrasp(given: Table, where: string, unit: number): SceneGrasp {
  refuseOthers(where, given, OF_GRASP);
  const near = vectorOf(given, "near", where, unit), radius = numberOf(given, "radius", where), closing = rowsOf(given, "closing", where);
  if (!near || !radius) throw new Error(word("world.grasp", { where, found: shownAs(given) }));
  return {
    near, radius: unit * radius, opposite: vectorOf(given, "opposite", where, unit), friction: numberOf(given, "friction", where, MOST_FRICTION),
    clampForce: numberOf(given, "clamp_force", where), closing: closing && inMetres(closing, unit), closed: timeSpans(given.closed, `${where} closed`),
  };
}

function nameOf(given: Table, where: string): string {
  if (typeof given.name !== "string" || !given.name) throw new Error(word("world.name", { where, found: shownAs(given.name) }));
  return given.name;
}

// A scene of one organ need not name it.
function organOf(given: Table, where: string, organs: string[]): number {
  const organ = given.organ === undefined && organs.length === 1 ? 0 : organs.indexOf(String(given.organ));
  if (organ < 0) throw new Error(word("world.organ", { where, organs: organs.join(", "), found: shownAs(given.organ) }));
  return organ;
}

// undefined where the file has none.
function numberOf(given: Table, key: string, where: string, most = Infinity): number | undefined {
  const value = given[key];
  if (value === undefined) return undefined;
  if (typeof value !== "number" || !(value >= 0 && value <= most)) throw new Error(word("world.number", { where, key, most: most === Infinity ? "∞" : most, found: shownAs(value) }));
  return value;
}

function wholeOf(given: Table, key: string, where: string, most = Infinity): number | undefined {
  const value = numberOf(given, key, where, most);
  if (value !== undefined && !Number.isInteger(value)) throw new Error(word("world.whole", { where, key, found: shownAs(value) }));
  return value;
}

function vectorOf(given: Table, key: string, where: string, unit: number): Vector | null {
  const value = given[key];
  if (value === undefined) return null;
  if (!isRow(value, 3)) throw new Error(word("world.vector", { where, key, found: shownAs(value) }));
  return value.map((x) => unit * x) as Vector;
}

// Rows of a time and lengths.
const inMetres = (rows: number[][], unit: number) => rows.map(([time, ...lengths]) => [time, ...lengths.map((x) => unit * x)]);

// Rows s, values of a CSV file that the scene names.
function fileRows(given: Table, key: string, where: string, columns: number, files: SceneFiles): number[][] {
  const name = String(given[key]), file = files(name);
  if (file === null) throw new Error(word("world.no-csv", { where, key, name }));
  try {
    return rowsOfFile(typeof file === "string" ? file : new TextDecoder().decode(file), columns);
  } catch (error) {
    throw new Error(word("notice.refused", { name, why: (error as Error).message }));
  }
}

// Rows s, value; null where the file has none.
function rowsOf(given: Table, key: string, where: string): number[][] | null {
  const rows = given[key];
  if (rows === undefined) return null;
  if (!Array.isArray(rows) || !rows.length || !rows.every((row) => isRow(row, 2))) throw new Error(word("world.rows", { where, key, found: shownAs(rows) }));
  checkTimes(rows, `${where} ${key}`);
  return rows;
}
