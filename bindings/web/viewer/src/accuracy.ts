// The page of the fronts: error against cost of the settings that palpate-accuracy measured. A point names its setting and opens its bundle.
import { choices, FRONTS, type ServedStudy, type Setting, type Study } from "./accuracy_study";
import { element } from "./elements";
import { FrontChart } from "./front_chart";
import { servedStudies, viewerAddress } from "./served";

const byId = <T extends HTMLElement = HTMLElement>(id: string) => document.getElementById(id) as T;

class FrontsPage {
  charts: FrontChart[] = [];
  private figures: HTMLElement[] = [];
  private study: Study | null = null;
  private served: ServedStudy | null = null;

  constructor(private studies: ServedStudy[]) {
    const choice = byId<HTMLSelectElement>("study");
    choice.append(...studies.map(({ organ, boundary }, i) => element("option", { value: i }, `${organ}, ${boundary}`)));
    choice.addEventListener("change", () => void this.open(this.studies[Number(choice.value)]));
    new ResizeObserver(() => this.draw()).observe(byId("fronts"));
  }

  async open(served: ServedStudy) {
    const answer = await fetch(`${served.address}/accuracy.json`).catch(() => null);
    const study = answer?.ok ? ((await answer.json().catch(() => null)) as Study | null) : null;
    byId("said").textContent = study?.points ? "" : `${served.address}/accuracy.json: expected what palpate-accuracy writes, found no such study.`;
    if (!study?.points) return;
    this.served = served;
    this.study = study;
    const settings = choices(study);
    byId("about").textContent = `${study.organ}, ${study.boundary}: a disc of ${study.radius_mm} mm pressed in by half its radius, ${settings.length} settings. Errors are relative to the study's reference.`;
    this.charts = FRONTS.map((axes) => new FrontChart(study, settings, axes, {
      address: (setting) => this.addressOf(setting), say: (setting) => this.words(setting), point: (setting) => this.show(setting),
    }));
    this.figures = this.charts.map(({ root }, i) => element("figure", {}, element("figcaption", {}, FRONTS[i].title), root));
    byId("fronts").replaceChildren(...this.figures);
    this.show(null);
    this.draw();
  }

  private draw() {
    this.charts.forEach((chart, i) => chart.draw(this.figures[i].clientWidth));
  }

  // The viewer with the setting's bundle and contact; null where the bundle is not there.
  private addressOf({ bundle, contact }: Setting): string | null {
    const { address, finer, bundles } = this.served!;
    if (!bundle || !bundles.includes(bundle)) return null;
    return `${viewerAddress({ bundle: `${address}/${bundle}`, finer })}#${new URLSearchParams({ contact, disc: String(this.study!.radius_mm) })}`;
  }

  private words(setting: Setting): string {
    return `${setting.name}: ${figuresOf(setting).map(([term, value]) => `${term} ${value}`).join(", ")}`;
  }

  private show(setting: Setting | null) {
    for (const chart of this.charts) chart.highlight(setting);
    const details = byId("setting");
    if (!setting) return details.replaceChildren(element("p", { class: "small" }, "Point at a setting, or choose one of the front by Tab."));
    const address = this.addressOf(setting);
    details.replaceChildren(element("h2", {}, setting.name),
      element("dl", {}, ...figuresOf(setting).flatMap(([term, value]) => [element("dt", {}, term), element("dd", {}, value)])),
      element("p", {}, address ? element("a", { href: address }, "Open its bundle") : `The study's folder no longer has its bundle; the study writes it again: make -f Makefile.data accuracy ORGAN=${this.study!.organ} BC=${this.study!.boundary}`));
  }
}

const percent = (share: number) => `${three(100 * share)} %`;
const three = (value: number) => String(Number(value.toPrecision(3)));

function figuresOf(s: Setting): [term: string, value: string][] {
  return [
    ["vertices", s.vertices.toLocaleString("en")], ["force error", `${percent(s.force_error)}, worst ${percent(s.force_error_worst)}`],
    ["field error", `${percent(s.field_error)}, at most ${three(s.field_error_mm)} mm`], ["touch", `${three(s.touch_us)} µs`], ["shape", `${three(s.shape_us)} µs`],
    ["precompute", `${three(s.precompute_s)} s, ${three(s.precompute_GB)} GB`], ["bundle", `${three(s.bundle_MB)} MB`],
  ];
}

const studies = await servedStudies();
byId("none").hidden = studies.length > 0;
byId("some").hidden = studies.length === 0;
const page = new FrontsPage(studies);
if (studies.length) await page.open(studies[0]);
Object.assign(globalThis, { palpateFronts: page }); // for scripts
document.body.dataset.state = "ready";
