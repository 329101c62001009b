// The worker's connection to the bridge of haptic devices and trackers (bridge/bridge.mjs): positions of tools come in, forces go back.
import { TOOL_COUNT, type Vector } from "./messages";

const REPLACED = 4000; // as in bridge.mjs
const MOST_QUEUED = 1 << 16; // bytes that the bridge has not taken yet: forces are left out then

export interface DeviceHooks {
  move: (index: number, point: Vector) => void; // m
  leave: (index: number) => void;
  changed: (state: LinkState, tools: string[]) => void;
}
export type LinkState = "open" | "refused" | "replaced" | "closed"; // refused: no bridge answers

// A device's tools take the page's last places, so that the pointer keeps its first one.
export class DeviceLink {
  private socket: WebSocket;
  private names: string[] = []; // of the tools that are there; names[0] is the last tool
  private wasOpen = false;

  constructor(port: number, private hooks: DeviceHooks) {
    this.socket = new WebSocket(`ws://127.0.0.1:${port}`);
    this.socket.addEventListener("open", () => {
      this.wasOpen = true;
      this.tell("open");
    });
    this.socket.addEventListener("message", ({ data }) => this.hear(JSON.parse(data)));
    this.socket.addEventListener("close", ({ code }) => {
      this.gone(this.names);
      this.tell(!this.wasOpen ? "refused" : code === REPLACED ? "replaced" : "closed");
    });
  }

  close() {
    this.socket.close();
  }

  owns(index: number): boolean {
    return this.names[TOOL_COUNT - 1 - index] !== undefined;
  }

  // After touches: the force on each tool of a device, N.
  send(forceOf: (index: number) => Vector) {
    if (this.socket.readyState !== WebSocket.OPEN || this.socket.bufferedAmount > MOST_QUEUED) return;
    this.names.forEach((tool, place) => tool !== undefined && this.socket.send(JSON.stringify({ tool, force: forceOf(TOOL_COUNT - 1 - place) })));
  }

  private hear({ tool, position, gone }: { tool?: string; position?: Vector; gone?: string[] }) {
    if (gone) return this.gone(gone);
    if (tool === undefined || !position) return;
    let place = this.names.indexOf(tool);
    if (place < 0) {
      place = Array.from({ length: TOOL_COUNT }, (_, i) => i).find((i) => this.names[i] === undefined) ?? -1;
      if (place < 0) return; // more tools than the page has
      this.names[place] = tool;
      this.tell("open");
    }
    this.hooks.move(TOOL_COUNT - 1 - place, position);
  }

  private gone(tools: string[]) {
    const places = [...this.names.keys()].filter((place) => this.names[place] !== undefined && tools.includes(this.names[place]));
    for (const place of places) {
      delete this.names[place];
      this.hooks.leave(TOOL_COUNT - 1 - place);
    }
    if (places.length && this.socket.readyState === WebSocket.OPEN) this.tell("open");
  }

  private tell(state: LinkState) {
    this.hooks.changed(state, this.names.filter((name) => name !== undefined));
  }
}
