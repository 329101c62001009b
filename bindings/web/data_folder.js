// The bundles of a data folder (pipelines/rules.mk): DATA/ORGAN/RESOLUTION/CASE/bundle.h5, each with its picture and the organ's finer
// surface. The server of the viewer lists them in bundles.json and serves them under data/.
import { existsSync, readdirSync, statSync } from "node:fs";
import { basename, dirname, join, resolve, sep } from "node:path";

const PICTURES = ["pictures/boundary.png", "pictures/mesh.png"]; // the first that is there
const SERVED = [".h5", ".ply", ".png"];

/** @param {string} folder @returns {import("./viewer/src/served").ServedBundle[]} */
export function bundlesOf(folder) {
  const files = /** @type {string[]} */ (existsSync(folder) ? readdirSync(folder, { recursive: true }) : []);
  const cases = files.filter((file) => basename(file) === "bundle.h5").map((file) => dirname(file).split(sep)).filter((parts) => parts.length > 2);
  return cases.map((parts) => {
    const organ = parts.slice(0, -2), here = parts.join("/"), address = (/** @type {string} */ file) => `data/${file}`;
    const finer = `${organ.join("/")}/render.ply`, picture = PICTURES.map((name) => `${here}/${name}`).find((name) => existsSync(join(folder, name)));
    return {
      organ: organ.join("/"), resolution: parts[parts.length - 2], boundary: parts[parts.length - 1],
      bytes: statSync(join(folder, here, "bundle.h5")).size, bundle: address(`${here}/bundle.h5`),
      finer: existsSync(join(folder, finer)) ? address(finer) : null, picture: picture ? address(picture) : null,
    };
  }).sort((a, b) => a.organ.localeCompare(b.organ) || a.bytes - b.bytes);
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
