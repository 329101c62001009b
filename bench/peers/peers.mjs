// node peers.mjs PUSH.json BUNDLE.h5 PALPATE_WEB_FOLDER OUT.json: adds to the rows of peers_bench those of Palpate's WebAssembly and of
// MuJoCo's, in one process. Runs in the folder that has MuJoCo's package (npm ci of package.json beside this file).
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [pushFile, bundleFile, web, out] = process.argv.slice(2);
const push = JSON.parse(readFileSync(pushFile, "utf8"));
const { node, displacements } = push, nodes = push.nodes.flat(), at = push.nodes[node];
const norm = (/** @type {ArrayLike<number>} */ v) => Math.hypot(...Array.from(v));

// Plays the push in steps of stepMs: tick(displacement) returns the force, N, [3]; surface() what has moved, m, [surface nodes][3].
// The time of a step is the mean of the process's processor time, which other programs on the machine do not change.
function row(name, stepMs, tick, surface) {
  let peak = 0, steps = 0;
  const start = process.cpuUsage();
  for (let time = stepMs; time <= displacements.length; time += stepMs, ++steps) peak = Math.max(peak, norm(tick(displacements[time - 1])));
  const { user, system } = process.cpuUsage(start);
  const moved = surface(), off = moved.map((x, i) => x - push.exact[i]);
  push.rows.push({
    name, step_ms: stepMs, time_ms: (user + system) / 1e3 / steps, error: norm(off) / norm(push.exact), peak_force_N: peak, surface: moved,
  });
}

async function palpate() {
  const { loadRuntime } = await import(pathToFileURL(resolve(import.meta.dirname, "../../bindings/web/module/palpate.js")));
  const runtime = await loadRuntime(readFileSync(`${web}/simd/palpate.wasm`));
  const bundle = runtime.openBundle(readFileSync(bundleFile));
  const scene = bundle.createScene({ collision: "off", contact: "node", forceLimit: 1e300, forceSlew: 1e300 });
  const tick = (displacement) => {
    scene.setTools([{ grips: [{ node, displacement }] }]);
    scene.touch(0.001);
    scene.shape();
    return scene.force(0);
  };
  for (let play = 0; play < 20; ++play) displacements.forEach(tick); // V8 compiles the calls
  row("Palpate, WebAssembly", 1, tick, () => Array.from(scene.displacements));
}

// A flex of the same tetrahedra. A connect constraint ties the pushed vertex to a mocap body; it is as stiff as MuJoCo's guide allows
// (twice the time step), since a softer one lets the vertex lag behind. Its force is what MuJoCo tells of the push.
async function mujoco() {
  const { default: load } = await import(pathToFileURL(createRequire(`${process.cwd()}/`).resolve("@mujoco/mujoco")));
  const engine = await load();
  const model = engine.MjModel.from_xml_string(`<mujoco>
    <option timestep="0.002" integrator="discrete" solver="CG" gravity="0 0 0"/>
    <worldbody>
      <body name="tool" mocap="true" pos="${at.join(" ")}"/>
      <flexcomp name="organ" type="direct" dim="3" mass="${push.mass}" radius="0.0005" point="${nodes.join(" ")}"
          element="${push.tetrahedra.flat().join(" ")}">
        <elasticity young="${push.young}" poisson="${push.poisson}" damping="0.01"/>
        <contact contype="0" conaffinity="0" internal="false" selfcollide="none"/>
        <pin id="${push.held.join(" ")}"/>
      </flexcomp>
    </worldbody>
    <equality>
      <connect body1="organ_${node}" body2="tool" anchor="0 0 0" solref="0.004 1" solimp="0.999 0.9999 0.001"/>
    </equality>
  </mujoco>`);
  const data = new engine.MjData(model);
  engine.mj_forward(model, data);
  const rest = Array.from(data.flexvert_xpos);
  const tick = (displacement) => {
    displacement.forEach((x, k) => { data.mocap_pos[k] = at[k] + x; });
    engine.mj_step(model, data);
    return data.efc_force.slice(0, 3);
  };
  row("MuJoCo 3.14, flex, WebAssembly", 2, tick,
    () => Array.from(data.flexvert_xpos).slice(0, 3 * push.surface_count).map((x, i) => x - rest[i]));
}

await palpate();
await mujoco();
writeFileSync(out, JSON.stringify(push));
