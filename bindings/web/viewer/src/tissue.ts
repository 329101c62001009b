// The organ's surface as it is drawn: moist tissue under the light of a room, with a soft shadow below the tools and rings around a dent.
import { Color, type IUniform, MeshPhysicalMaterial, PMREMGenerator, Vector3, Vector4, type WebGLRenderer } from "three";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";
import { TOOL_COUNT } from "./messages";
import type { Quality } from "./quality";

// The light of a room, made once for all that shines.
export function roomLight(renderer: WebGLRenderer) {
  const generator = new PMREMGenerator(renderer), room = new RoomEnvironment(), light = generator.fromScene(room, 0.04).texture;
  room.dispose();
  generator.dispose();
  return light;
}

// What a tool takes of the light around it: a rod from `tip` along `axis` (m).
interface Shade {
  tip: Vector3;
  end: Vector3;
  radius: number; // 0: no tool
}

export class Tissue extends MeshPhysicalMaterial {
  private shades = { tips: { value: [] as Vector4[] } satisfies IUniform, ends: { value: [] as Vector3[] } satisfies IUniform };
  private ringStep = { value: 0 } satisfies IUniform;

  constructor() {
    super({ vertexColors: true, roughness: 0.5, metalness: 0, specularIntensity: 0.6, clearcoat: 0.5, clearcoatRoughness: 0.28 });
    this.sheenColor = new Color(0xff8f7a);
    for (let t = 0; t < TOOL_COUNT; ++t) {
      this.shades.tips.value.push(new Vector4());
      this.shades.ends.value.push(new Vector3());
    }
    this.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, { shadeTips: this.shades.tips, shadeEnds: this.shades.ends, ringStep: this.ringStep });
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", "#include <common>\nvarying vec3 shadedPlace;\nattribute float dent;\nvarying float ringDent;")
        .replace("#include <project_vertex>", "#include <project_vertex>\nshadedPlace = (modelMatrix * vec4(transformed, 1.0)).xyz;\nringDent = dent;");
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", `#include <common>\n${SHADE}\n${RINGS}`)
        .replace("#include <opaque_fragment>", "outgoingLight *= shadeOfTools() * lightOfRings();\n#include <opaque_fragment>");
    };
  }

  draw(quality: Quality) {
    const high = quality === "high";
    this.clearcoat = high ? 0.5 : 0;
    this.sheen = high ? 0.25 : 0;
    this.roughness = high ? 0.5 : 0.42;
    this.needsUpdate = true;
  }

  // step: m of the geometry's attribute `dent` between two rings; 0: there are none.
  rings(step: number) {
    this.ringStep.value = step;
  }

  shade(tools: (Shade | null)[]) {
    tools.forEach((tool, t) => {
      this.shades.tips.value[t].set(tool?.tip.x ?? 0, tool?.tip.y ?? 0, tool?.tip.z ?? 0, tool?.radius ?? 0);
      if (tool) this.shades.ends.value[t].copy(tool.end);
    });
  }
}

// Lines where `dent` is 2, 3 or 4 steps, one and a half pixels wide; none where they would touch one another. One step is noise far from a
// tool, and below a disc the dent is flat.
const RINGS = `
varying float ringDent;
uniform float ringStep;
float lightOfRings() {
  if (ringStep <= 0.0) return 1.0;
  float rings = ringDent / ringStep, pixel = fwidth(rings), away = abs(fract(rings + 0.5) - 0.5);
  float line = (1.0 - smoothstep(0.5 * pixel, 1.5 * pixel, away)) * step(1.5, rings) * step(rings, 4.5) * (1.0 - smoothstep(0.15, 0.4, pixel));
  return 1.0 - 0.5 * line;
}`;

// A place near a rod sees less of the room: darkest below its surface, gone two and a half radii away.
const SHADE = `
varying vec3 shadedPlace;
uniform vec4 shadeTips[${TOOL_COUNT}];
uniform vec3 shadeEnds[${TOOL_COUNT}];
float shadeOfTools() {
  float light = 1.0;
  for (int t = 0; t < ${TOOL_COUNT}; ++t) {
    float radius = shadeTips[t].w;
    if (radius <= 0.0) continue;
    vec3 way = shadeEnds[t] - shadeTips[t].xyz, from = shadedPlace - shadeTips[t].xyz;
    float along = clamp(dot(from, way) / dot(way, way), 0.0, 1.0);
    float away = distance(from, along * way) / radius;
    float near = 1.0 - smoothstep(0.8, 2.6, away);
    light *= 1.0 - 0.72 * near * near;
  }
  return light;
}`;
