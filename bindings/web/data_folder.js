// What the viewer's server shows of a data folder (pipelines/rules.mk), under data/: the bundles DATA/ORGAN/RESOLUTION/CASE/bundle.h5, each
// with its picture and the organ's finer surface, listed in bundles.json; the reports of palpate-accuracy, listed in studies.json.
import { existsSync, readdirSync, statSync } from "node:fs";
import { basename, dirname, join, resolve, sep } from "node:path";

const PICTURES = ["pictures/boundary.png", "pictures/mesh.png"]; // the first that is there
const SERVED = [".h5", ".ply", ".png", "/report.html"];

/** @param {string} folder @returns {import("./viewer/src/served").ServedBundle[]} */
export function bundlesOf(folder) {
  return foldersWith(folder, "bundle.h5").map((parts) => {
    const organ = parts.slice(0, -2).join("/"), here = parts.join("/"), picture = PICTURES.map((name) => `${here}/${name}`).find((name) => existsSync(join(folder, name)));
    return {
      organ, resolution: parts[parts.length - 2], boundary: parts[parts.length - 1],
      bytes: statSync(join(folder, here, "bundle.h5")).size, bundle: `data/${here}/bundle.h5`,
      finer: finerSurface(folder, organ), picture: picture ? `data/${picture}` : null,
    };
  }).sort((a, b) => a.organ.localeCompare(b.organ) || a.bytes - b.bytes);
}

/** Reports of studies: DATA/ORGAN/accuracy/BC/report.html. Their points open the bundles beside them.
 *  @param {string} folder @returns {import("./viewer/src/served").ServedStudy[]} */
export function studiesOf(folder) {
  return foldersWith(folder, "report.html").filter((parts) => parts[parts.length - 2] === "accuracy").map((parts) =>
    ({ organ: parts.slice(0, -2).join("/"), boundary: parts[parts.length - 1], report: `data/${parts.join("/")}/report.html` }));
}

// The folders, as their names, that hold a file of this name and lie at least two folders deep in an organ's.
function foldersWith(/** @type {string} */ folder, /** @type {string} */ name) {
  const files = /** @type {string[]} */ (existsSync(folder) ? readdirSync(folder, { recursive: true }) : []);
  return files.filter((file) => basename(file) === name).map((file) => dirname(file).split(sep)).filter((parts) => parts.length > 2);
}

function finerSurface(/** @type {string} */ folder, /** @type {string} */ organ) {
  return existsSync(join(folder, organ, "render.ply")) ? `data/${organ}/render.ply` : null;
}

/** The file of a request below scenes/: ORGAN/NAME.toml is a scene of pipelines/, studies/NAME.toml one of studies/played.
 *  @param {string} repository @param {string} url */
export function sceneOf(repository, url) {
  const [, organ, name] = /^\/([\w-]+)\/([\w-]+)\.toml$/.exec(url) ?? [];
  if (!organ) return undefined;
  return join(repository, organ === "studies" ? "studies/played" : `pipelines/${organ}/scenes`, `${name}.toml`);
}

/** The file of a request below data/; undefined where the folder has no such file, or where it is none that the pages show.
 *  @param {string} folder @param {string} url */
export function fileOf(folder, url) {
  const file = resolve(folder, `.${decoded(url.replace(/[?#].*/, ""))}`);
  const isInside = file.startsWith(resolve(folder) + sep);
  return isInside && SERVED.some((ending) => file.endsWith(ending)) && existsSync(file) ? file : undefined;
}

// An address that no path encodes names the folder itself, which is no file.
function decoded(/** @type {string} */ path) {
  try {
    return decodeURIComponent(path);
  } catch {
    return "";
  }
}
