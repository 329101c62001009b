// The files of a scene of several organs: from the page's server, or those that the user drops together.
import type { WorldFile } from "./world_messages";
import { filesOfScene, readWorld, type SceneFiles } from "./world_reader";
import type { WorldScene } from "./world_scene";
import { word } from "./words";

const MORE = [".csv", ".ply", ".stl", ".obj", ".off"]; // of what a scene names beside bundles

export interface WorldFiles {
  scene: WorldScene;
  files: WorldFile[];
  of: number[]; // the file of each organ
}

// The scene that the page's address names (?scene=ADDRESS), with the bundles that it names beside it; else the one that the server was
// started with, whose bundles are world-bundles/ORGAN.h5. null: the server has none. Throws an Error that says what is wrong with it.
export async function servedWorld(): Promise<WorldFiles | null> {
  const named = new URLSearchParams(location.search).get("scene"), address = new URL(named ?? "world.toml", location.href);
  const answer = await fetch(address).catch(() => null);
  if (!answer?.ok) {
    if (named) throw new Error(word("world.no-scene", { url: named }));
    return null;
  }
  const text = await answer.text(), scene = await readNamed(lastPart(address.pathname), async () => readWorld(text, await servedFilesOf(text, address)));
  const bundle = (name: string, bundle: string | null) => {
    if (!named) return `world-bundles/${name}.h5`;
    if (!bundle) throw new Error(word("world.no-bundle", { organ: name }));
    return bundle;
  };
  return ofFiles(scene, scene.organs.map((organ) => bundle(organ.name, organ.bundle)), (name) => new URL(name, named ? address : location.href).href);
}

// Throws an Error that names the file that is missing.
export async function droppedWorld(dropped: File[]): Promise<WorldFiles> {
  const ends = (file: File, ending: string) => file.name.toLowerCase().endsWith(ending), found = dropped.find((file) => ends(file, ".toml"));
  const named = dropped.filter((file) => MORE.some((ending) => ends(file, ending))), bundles = dropped.filter((file) => file !== found && !named.includes(file));
  if (!found) throw new Error(word("world.scene-first", { name: dropped[0].name }));
  const scene = await readNamed(found.name, async () => readWorld(await found.text(), await sceneFiles(named)));
  // Bundles of several folders that have one name are told apart by the organ's name alone.
  const paths = scene.organs.map(({ bundle }) => bundle), isOwn = (path: string) => !paths.some((other) => other && other !== path && lastPart(other) === lastPart(path));
  const names = scene.organs.map(({ name, bundle }) => {
    const wanted = [`${name}.h5`, ...(bundle && isOwn(bundle) ? [lastPart(bundle)] : [])], file = wanted.find((one) => bundles.some((given) => given.name === one));
    if (!file) throw new Error(word("world.no-file", { organ: name, wanted: wanted.join(word("world.or")), found: bundles.map((given) => given.name).join(", ") || word("scene.nothing") }));
    return file;
  });
  const bytes = new Map(await Promise.all(bundles.map(async (file) => [file.name, await file.arrayBuffer()] as const)));
  return ofFiles(scene, names, (name) => bytes.get(name)!);
}

// With the scene's name in front of what is wrong with it.
async function readNamed(name: string, read: () => Promise<WorldScene>): Promise<WorldScene> {
  try {
    return await read();
  } catch (error) {
    throw new Error(word("notice.refused", { name, why: (error as Error).message }));
  }
}

const lastPart = (path: string) => path.slice(path.lastIndexOf("/") + 1);

// Of the files that a scene names, as the user chooses them; none of a text that is no scene.
export function namesOf(text: string): string[] {
  try {
    return filesOfScene(text).map(lastPart);
  } catch {
    return [];
  }
}

// CSV files and meshes that the user chose together with the scene that names them.
export async function sceneFiles(chosen: File[]): Promise<SceneFiles> {
  const all = new Map(await Promise.all(chosen.map(async (file) => [file.name, new Uint8Array(await file.arrayBuffer())] as const)));
  return (name) => all.get(lastPart(name)) ?? null;
}

// Those beside a scene that the server has.
async function servedFilesOf(text: string, scene: URL): Promise<SceneFiles> {
  const all = new Map<string, Uint8Array>();
  for (const name of filesOfScene(text)) {
    const answer = await fetch(new URL(name, scene)).catch(() => null);
    if (answer?.ok) all.set(name, new Uint8Array(await answer.arrayBuffer()));
  }
  return (name) => all.get(name) ?? null;
}

function ofFiles(scene: WorldScene, names: string[], source: (name: string) => WorldFile["source"]): WorldFiles {
  const all = [...new Set(names)];
  return { scene, files: all.map((name) => ({ name, source: source(name) })), of: names.map((name) => all.indexOf(name)) };
}
