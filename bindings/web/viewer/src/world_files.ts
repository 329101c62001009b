// The files of a scene of several organs: from the page's server, or those that the user drops together.
import type { WorldFile } from "./world_messages";
import { readWorld } from "./world_reader";
import type { WorldScene } from "./world_scene";
import { word } from "./words";

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
  const scene = readWorld(await answer.text());
  const bundle = (name: string, bundle: string | null) => {
    if (!named) return `world-bundles/${name}.h5`;
    if (!bundle) throw new Error(word("world.no-bundle", { organ: name }));
    return bundle;
  };
  return ofFiles(scene, scene.organs.map((organ) => bundle(organ.name, organ.bundle)), (name) => new URL(name, named ? address : location.href).href);
}

// Throws an Error that names the file that is missing.
export async function droppedWorld(dropped: File[]): Promise<WorldFiles> {
  const isScene = (file: File) => file.name.toLowerCase().endsWith(".toml"), found = dropped.find(isScene), bundles = dropped.filter((file) => !isScene(file));
  if (!found) throw new Error(word("world.scene-first", { name: dropped[0].name }));
  const scene = readWorld(await found.text()), lastPart = (path: string) => path.slice(path.lastIndexOf("/") + 1);
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

function ofFiles(scene: WorldScene, names: string[], source: (name: string) => WorldFile["source"]): WorldFiles {
  const all = [...new Set(names)];
  return { scene, files: all.map((name) => ({ name, source: source(name) })), of: names.map((name) => all.indexOf(name)) };
}
