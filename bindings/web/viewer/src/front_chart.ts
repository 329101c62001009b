// Draws settings as points of error against cost, both logarithmic, with the front that no other setting beats.
import { errorOfReference, paretoFront, type FrontAxes, type Setting, type Study } from "./accuracy_study";
import { svg } from "./elements";
import { decimal, word } from "./words";

const HEIGHT = 340; // px
const MARGIN = { left: 54, right: 16, top: 12, bottom: 44 };
const RADIUS = 5; // of a marker, px
const REACH = 12; // px: a pointer this near to a point means that point
const LETTER = 6.5; // px, a generous width, by which names of the front keep apart

export interface ChartEvents {
  address: (setting: Setting) => string | null; // what a click on the point opens
  say: (setting: Setting) => string; // for those who cannot see the point
  point: (setting: Setting | null) => void; // the pointer or the focus is on it
}

export class FrontChart {
  readonly root = svg("svg", { role: "group", height: HEIGHT });
  private drawn = new Map<Setting, SVGElement>();
  private front: Setting[];
  private settings: Setting[];

  constructor(private study: Study, settings: Setting[], private axes: FrontAxes, private events: ChartEvents) {
    this.settings = settings.filter((setting) => this.cost(setting) > 0 && this.error(setting) > 0);
    this.front = paretoFront(this.settings, (s) => this.cost(s), (s) => this.error(s));
    this.root.setAttribute("aria-label", word(axes.title));
  }

  private cost = (setting: Setting) => setting[this.axes.cost];
  private error = (setting: Setting) => 100 * setting[this.axes.error];

  draw(width: number) {
    this.root.setAttribute("width", String(width));
    this.drawn.clear();
    this.root.replaceChildren();
    if (!this.settings.length) return this.root.append(svg("text", { x: MARGIN.left, y: HEIGHT / 2 }, word("accuracy.empty")));
    const x = logarithmic(this.settings.map(this.cost), MARGIN.left, width - MARGIN.right), y = logarithmic(this.settings.map(this.error), HEIGHT - MARGIN.bottom, MARGIN.top);
    this.root.append(this.band(y, width), this.grid(x, y, width), this.line(x, y), this.names(x, y, width));
    const rest = this.settings.filter((setting) => !this.front.includes(setting));
    for (const setting of [...rest, ...this.front]) this.root.append(this.marker(setting, x.at(this.cost(setting)), y.at(this.error(setting))));
  }

  // Marks the setting in this chart; null: none.
  highlight(setting: Setting | null) {
    for (const [one, marker] of this.drawn) marker.classList.toggle("on", one === setting);
  }

  private grid(x: Scale, y: Scale, width: number) {
    const bottom = HEIGHT - MARGIN.bottom, group = svg("g", { class: "grid", "aria-hidden": "true" });
    for (const tick of x.ticks) group.append(svg("line", { x1: x.at(tick), x2: x.at(tick), y1: MARGIN.top, y2: bottom }), svg("text", { x: x.at(tick), y: bottom + 16, "text-anchor": "middle" }, decimal(tick)));
    for (const tick of y.ticks) group.append(svg("line", { x1: MARGIN.left, x2: width - MARGIN.right, y1: y.at(tick), y2: y.at(tick) }), svg("text", { x: MARGIN.left - 7, y: y.at(tick) + 4, "text-anchor": "end" }, decimal(tick)));
    const middle = (MARGIN.top + bottom) / 2;
    group.append(svg("text", { x: (MARGIN.left + width - MARGIN.right) / 2, y: HEIGHT - 8, "text-anchor": "middle" }, word(this.axes.costLabel)),
      svg("text", { x: 13, y: middle, "text-anchor": "middle", transform: `rotate(-90 13 ${middle})` }, word(this.axes.errorLabel)));
    return group;
  }

  // Below the reference's own error, differences mean nothing.
  private band(y: Scale, width: number) {
    const error = errorOfReference(this.study, this.axes), group = svg("g", { class: "band", "aria-hidden": "true" }), bottom = HEIGHT - MARGIN.bottom;
    if (!error || y.at(100 * error) >= bottom) return group;
    const top = Math.max(MARGIN.top, y.at(100 * error));
    group.append(svg("rect", { x: MARGIN.left, y: top, width: width - MARGIN.left - MARGIN.right, height: bottom - top }),
      svg("text", { x: MARGIN.left + 6, y: Math.min(top + 15, bottom - 5) }, word("accuracy.band")));
    return group;
  }

  // Steps: from one setting of the front to the next, the error stays until the cost is reached.
  private line(x: Scale, y: Scale) {
    const corners = this.front.map((setting, i) => `${i ? "H" : "M"}${x.at(this.cost(setting))}${i ? "V" : " "}${y.at(this.error(setting))}`);
    return svg("path", { class: "front", d: corners.join(""), "aria-hidden": "true" });
  }

  // Names the front's settings where a name covers no other one.
  private names(x: Scale, y: Scale, width: number) {
    const group = svg("g", { class: "names", "aria-hidden": "true" }), taken: [left: number, right: number, y: number][] = [];
    for (const setting of this.front) {
      const px = x.at(this.cost(setting)), py = y.at(this.error(setting)) - 9, long = LETTER * setting.name.length, toLeft = px + 6 + long > width;
      const left = toLeft ? px - 6 - long : px + 6;
      if (left < MARGIN.left || taken.some(([l, r, at]) => Math.abs(at - py) < 14 && left < r && left + long > l)) continue;
      taken.push([left, left + long, py]);
      group.append(svg("text", { x: toLeft ? px - 6 : px + 6, y: py, "text-anchor": toLeft ? "end" : "start" }, setting.name));
    }
    return group;
  }

  private marker(setting: Setting, x: number, y: number): SVGElement {
    const address = this.events.address(setting), onFront = this.front.includes(setting), say = this.events.say(setting);
    const faint = setting.contact === "patch" ? "" : " faint", group = svg("g", { class: `marker ${setting.element}${faint}`, transform: `translate(${x} ${y})` });
    group.append(svg("circle", { class: "reach", r: REACH }), svg("path", { d: shapeOf(setting.element) }));
    // A link where there is a bundle to open. The keyboard stops at the front's settings alone.
    const whole = address ? svg("a", { href: address, "aria-label": say }, group) : svg("g", { role: "img", "aria-label": say }, group);
    whole.setAttribute("tabindex", onFront ? "0" : "-1");
    for (const type of ["pointerenter", "focus"]) whole.addEventListener(type, () => this.events.point(setting));
    this.drawn.set(setting, group);
    return whole;
  }
}

// A path around the origin: the same shapes as in the report.
function shapeOf(element: string): string {
  const r = RADIUS;
  if (element === "p1") return `M${-r} ${-r}h${2 * r}v${2 * r}h${-2 * r}z`;
  if (element === "p2-p0") return `M0 ${-r * 1.2}L${r * 1.1} ${r * 0.9}H${-r * 1.1}z`;
  return `M${-r} 0a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0z`;
}

interface Scale {
  at: (value: number) => number; // px
  ticks: number[];
}

// from, to: px of the least and of the largest value, with some room around.
function logarithmic(values: number[], from: number, to: number): Scale {
  const low = Math.log10(Math.min(...values)) - 0.08, high = Math.log10(Math.max(...values)) + 0.08;
  const at = (value: number) => from + ((Math.log10(value) - low) / (high - low)) * (to - from);
  const digits = high - low > 1.6 ? [1] : [1, 2, 5], ticks: number[] = [];
  for (let power = Math.floor(low); power <= high; ++power)
    for (const digit of digits) {
      const tick = Number((digit * 10 ** power).toPrecision(1));
      if (Math.log10(tick) >= low && Math.log10(tick) <= high) ticks.push(tick);
    }
  return { at, ticks };
}
