// The page of the fronts: error against cost of the settings that palpate-accuracy measured. A point names its setting and opens its bundle.
import { choices, FRONTS, type ServedStudy, type Setting, type Study } from "./accuracy_study";
import { element } from "./elements";
import { FrontChart } from "./front_chart";
import { servedStudies, viewerAddress } from "./served";
import { chosenLanguage, count, decimal, offerLanguages, speak, tell, word } from "./words";

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
    byId("said").textContent = study?.points ? "" : word("accuracy.expected", { file: `${served.address}/accuracy.json` });
    if (!study?.points) return;
    this.served = served;
    this.study = study;
    this.fill();
  }

  // In the page's language.
  fill() {
    const { study } = this;
    if (!study) return;
    const settings = choices(study);
    byId("about").textContent = word("accuracy.of", { organ: study.organ, boundary: study.boundary, mm: decimal(study.radius_mm), count: settings.length });
    this.charts = FRONTS.map((axes) => new FrontChart(study, settings, axes, {
      address: (setting) => this.addressOf(setting), say: (setting) => this.words(setting), point: (setting) => this.show(setting),
    }));
    this.figures = this.charts.map(({ root }, i) => element("figure", {}, element("figcaption", {}, word(FRONTS[i].title)), root));
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
    const organ = viewerAddress({ bundle: `${address}/${bundle}`, finer }), setting = new URLSearchParams({ contact, disc: String(this.study!.radius_mm) });
    return `${organ}#${setting}`;
  }

  private words(setting: Setting): string {
    return `${setting.name}: ${figuresOf(setting).map(([term, value]) => `${term} ${value}`).join(", ")}`;
  }

  private show(setting: Setting | null) {
    for (const chart of this.charts) chart.highlight(setting);
    const details = byId("setting");
    if (!setting) return details.replaceChildren(element("p", { class: "small" }, word("accuracy.point")));
    const address = this.addressOf(setting);
    details.replaceChildren(element("h2", {}, setting.name),
      element("dl", {}, ...figuresOf(setting).flatMap(([term, value]) => [element("dt", {}, term), element("dd", {}, value)])),
      element("p", {}, address ? element("a", { href: address }, word("accuracy.open")) : ""));
    if (!address) tell(details.querySelector("p")!, "accuracy.gone", { organ: this.study!.organ, boundary: this.study!.boundary });
  }
}

const percent = (share: number) => `${three(100 * share)} %`;
const three = (value: number) => decimal(Number(value.toPrecision(3)));

function figuresOf(s: Setting): [term: string, value: string][] {
  return [
    [word("accuracy.vertices"), count(s.vertices)], [word("accuracy.force-error"), word("accuracy.worst", { error: percent(s.force_error), worst: percent(s.force_error_worst) })],
    [word("accuracy.field-error"), word("accuracy.at-most", { error: percent(s.field_error), mm: three(s.field_error_mm) })],
    [word("accuracy.touch"), `${three(s.touch_us)} µs`], [word("accuracy.shape"), `${three(s.shape_us)} µs`],
    [word("accuracy.precompute"), `${three(s.precompute_s)} s, ${three(s.precompute_GB)} GB`], [word("accuracy.bundle"), `${three(s.bundle_MB)} MB`],
  ];
}

speak(chosenLanguage());
const studies = await servedStudies();
byId("none").hidden = studies.length > 0;
byId("some").hidden = studies.length === 0;
const page = new FrontsPage(studies);
offerLanguages(() => page.fill());
if (studies.length) await page.open(studies[0]);
Object.assign(globalThis, { palpateFronts: page }); // for scripts
document.body.dataset.state = "ready";
