// The organ in a headset (WebXR): it floats before the user in its own size. The tip of each controller is a tool that pushes what it
// meets; with the trigger pulled before, it takes hold of what it meets.
import { CylinderGeometry, Mesh as Object3, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3, type XRTargetRaySpace } from "three";
import { TOOL_COUNT, type ToolFrame, type ToolTarget, type Vector } from "./messages";
import type { OrganView } from "./organ_view";

const BEFORE = new Vector3(0, -0.15, -0.5); // m: where the organ's centre is for a head that looks along -z with y up
const UPRIGHT = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -Math.PI / 2); // the bundle's z is up, and -y towards the user
const REACH = 0.06; // m from the controller to its tip
const NEAR = 0.03; // m: a tip that is nearer to the organ than this is a tool
const STRONGEST = 2; // N: the strongest vibration
const PULSE = 30; // ms, longer than a frame

export interface HeadsetHooks {
  isOpen: () => boolean;
  tools: () => (ToolFrame | null)[];
  positions: () => Float32Array | null; // of the surface, [node][3] m
  send: (index: number, target: ToolTarget) => void;
  begun: () => void;
}

interface Hand {
  controller: XRTargetRaySpace; // of three.js, in the bundle's frame
  source: XRInputSource | null;
  start: Vector | null; // where it became a tool; null: it is none
  takes: boolean; // the trigger is pulled
  grasp: Vector | null; // where it takes hold, or took it
}

export class Headset {
  private session: XRSession | null = null;
  private hands: Hand[];

  // button: shown only where the browser can show a headset.
  constructor(private view: OrganView, private button: HTMLElement, private hooks: HeadsetHooks) {
    this.hands = Array.from({ length: TOOL_COUNT }, (_, i) => this.hand(view.xr.getController(i)));
    button.hidden = true;
    button.addEventListener("click", () => void (this.session ? this.session.end() : this.begin()));
    navigator.xr?.isSessionSupported("immersive-vr").then((can) => (button.hidden = !can), () => {});
  }

  // Once per drawn frame.
  tick() {
    if (this.session) this.hands.forEach((hand, index) => this.follow(hand, index));
  }

  private hand(controller: XRTargetRaySpace): Hand {
    const hand: Hand = { controller, source: null, start: null, takes: false, grasp: null };
    controller.addEventListener("connected", ({ data }) => (hand.source = data));
    controller.addEventListener("disconnected", () => (hand.source = null));
    controller.addEventListener("selectstart", () => (hand.takes = true));
    controller.addEventListener("selectend", () => (hand.takes = false));
    const metal = new MeshStandardMaterial({ color: "#8d9aa3", roughness: 0.4 });
    const shaft = new Object3(new CylinderGeometry(0.0012, 0.0025, REACH, 12).rotateX(-Math.PI / 2).translate(0, 0, -REACH / 2), metal);
    controller.add(shaft, new Object3(new SphereGeometry(0.002, 12, 8).translate(0, 0, -REACH), metal));
    this.view.add(controller);
    return hand;
  }

  // Rejects where the user refuses; then nothing has changed.
  private async begin() {
    if (!this.hooks.isOpen()) return;
    const session = await navigator.xr!.requestSession("immersive-vr").catch(() => null);
    if (!session) return;
    const { xr, camera } = this.view, before = camera.view;
    this.session = session;
    this.button.setAttribute("aria-pressed", "true");
    session.addEventListener("end", () => {
      this.session = null;
      this.button.setAttribute("aria-pressed", "false");
      this.hands.forEach((hand, index) => this.leave(hand, index));
      xr.enabled = false;
      camera.view = before;
    });
    xr.enabled = true;
    xr.setReferenceSpaceType("local");
    await xr.setSession(session);
    // The frame in which three.js draws and has the controllers' places becomes the bundle's.
    const at = BEFORE.clone().sub(camera.controls.target.clone().applyQuaternion(UPRIGHT));
    xr.setReferenceSpace(xr.getReferenceSpace()!.getOffsetReferenceSpace(new XRRigidTransform(at, UPRIGHT)));
    this.hooks.begun();
  }

  private follow(hand: Hand, index: number) {
    const tip = new Vector3(0, 0, -REACH).applyMatrix4(hand.controller.matrix), tool = this.hooks.tools()[index];
    if (!hand.source || !hand.controller.visible || !(tool?.contacts || this.isNear(tip))) return this.leave(hand, index);
    const point = tip.toArray() as Vector;
    hand.start ??= point;
    // A tool that is in the organ already cannot take hold: the runtime makes that contact where a tool comes in.
    hand.grasp = !hand.takes ? null : tool?.contacts ? hand.grasp : point;
    this.hooks.send(index, { start: hand.start, point, grasp: hand.grasp, down: true });
    if (tool) vibrate(hand.source, Math.hypot(...tool.force));
  }

  private leave(hand: Hand, index: number) {
    if (hand.start) this.hooks.send(index, { start: hand.start, point: hand.start, grasp: null, down: false });
    hand.start = hand.grasp = null;
  }

  private isNear({ x, y, z }: Vector3): boolean {
    const nodes = this.hooks.positions() ?? [];
    for (let n = 0; n < nodes.length; n += 3) if (Math.hypot(nodes[n] - x, nodes[n + 1] - y, nodes[n + 2] - z) < NEAR) return true;
    return false;
  }
}

// Where the controller can.
function vibrate({ gamepad }: XRInputSource, newtons: number) {
  const motor = gamepad?.hapticActuators?.[0] as { pulse?: (strength: number, ms: number) => void } | undefined;
  if (newtons > 0.01) motor?.pulse?.(Math.min(1, newtons / STRONGEST), PULSE);
}
