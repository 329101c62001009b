// The bundles that the page's server has: the one that it was started with, and those of its data folder.
import { decimal, word } from "./words";

export interface ServedBundle {
  organ: string;
  resolution: string;
  boundary: string; // the folder of the boundary set, with the material file if it is another one
  bytes: number;
  bundle: string; // address
  finer: string | null; // address of the finer surface to draw
  picture: string | null;
}

// The report of a study of palpate-accuracy.
export interface ServedStudy {
  organ: string;
  boundary: string;
  report: string; // address
}

export interface ServedFiles {
  bundle: string;
  finer: string | null;
  isNamed: boolean; // by the page's address
}

// What a page opens: the bundle that its address names (?bundle=...&finer=...), or else the one that the server was started with.
export function servedFiles(): ServedFiles {
  const words = new URLSearchParams(location.search), bundle = words.get("bundle"), finer = words.get("finer");
  const absolute = (address: string) => new URL(address, location.href).href;
  if (!bundle) return { bundle: absolute("bundle.h5"), finer: absolute("render.ply"), isNamed: false };
  return { bundle: absolute(bundle), finer: finer && absolute(finer), isNamed: true };
}

// The address of the viewer with one of the server's bundles. more: further words.
export function viewerAddress({ bundle, finer }: Pick<ServedBundle, "bundle" | "finer">, more: Record<string, string> = {}): string {
  return `index.html?${new URLSearchParams({ bundle, ...(finer ? { finer } : {}), ...more })}`;
}

export const servedBundles = () => listed<ServedBundle>("bundles.json");
export const servedStudies = () => listed<ServedStudy>("studies.json");

async function listed<Entry>(url: string): Promise<Entry[]> {
  const answer = await fetch(url).catch(() => null);
  return answer?.ok ? answer.json() : [];
}

// A file from the server; null where the server does not have it.
export async function fetched(url: string | null) {
  const answer = url && (await fetch(url).catch(() => null));
  const bytes = answer && answer.ok ? await answer.arrayBuffer().catch(() => null) : null;
  return bytes && { name: url!.slice(url!.lastIndexOf("/") + 1), bytes };
}

export const megabytes = (bytes: number) => (bytes / 1e6).toFixed(bytes < 1e7 ? 1 : 0);

export const progressWords = (done: number, total: number) =>
  word(!total ? "loading.done" : done < total ? "loading.progress" : "loading.checking", { done: decimal(megabytes(done)), total: decimal(megabytes(total)) });
