// The gallery: every bundle of the server's data folder, the reports of accuracy, and the task of finding the hidden nodule.
import { named } from "./anatomy";
import { element } from "./elements";
import { bundleOfCase, commandOfCase, GUIDED_CASES, type GuidedCase } from "./guided_cases";
import { megabytes, servedBundles, servedStudies, viewerAddress, type ServedBundle } from "./served";
import { chosenLanguage, decimal, offerLanguages, speak, tell, word, type Key } from "./words";

const TASK_ORGAN = "liver-tumour";

// Of a folder of several organs, as "upper-abdomen/liver".
const namedPath = (organ: string) => organ.split("/").map(named).join(": ");

function card(bundle: ServedBundle): HTMLElement {
  const { organ, boundary, resolution, bytes, picture } = bundle;
  const facts = [[word("gallery.held"), named(boundary)], [word("gallery.mesh"), resolution], [word("gallery.size"), `${decimal(megabytes(bytes))} MB`]];
  const shown = picture ? element("img", { src: picture, alt: word("gallery.picture", { organ: namedPath(organ), boundary: named(boundary) }), loading: "lazy" }) : said("gallery.no-picture");
  return element("li", {}, element("a", { href: viewerAddress(bundle) },
    element("div", { class: "picture" }, shown),
    element("div", { class: "about" }, element("h2", {}, namedPath(organ)), element("dl", {}, ...facts.flatMap(([term, value]) => [element("dt", {}, term), element("dd", {}, value)])))));
}

// The organ as it is, not one of the other materials of its folder, which lie in folders of longer names.
const taskBundle = (bundles: ServedBundle[]) => bundles.filter(({ organ }) => organ === TASK_ORGAN).sort((a, b) => a.boundary.length - b.boundary.length || a.bytes - b.bytes)[0];

function said(key: Key, values?: Record<string, string>): HTMLElement {
  const span = element("span");
  tell(span, key, values);
  return span;
}

// A guided case: its start, or what makes the bundle that it needs.
function guided(one: GuidedCase, bundles: ServedBundle[]): HTMLElement {
  const { name } = one, bundle = bundleOfCase(one, bundles);
  return element("p", {}, bundle ? element("a", { class: "primary", href: viewerAddress(bundle, { case: name }) }, word(`case.${name}` as Key))
    : said("gallery.cases.needs", { name: word(`case.${name}` as Key), command: commandOfCase(one) }));
}

// In the page's language.
function show(bundles: ServedBundle[]) {
  const withNodule = taskBundle(bundles);
  document.getElementById("organs")!.replaceChildren(...bundles.map(card));
  document.getElementById("cases-start")!.replaceChildren(...GUIDED_CASES.map((one) => guided(one, bundles)));
  document.getElementById("task-start")!.replaceChildren(withNodule
    ? element("a", { class: "primary", href: viewerAddress(withNodule, { task: "nodule" }) }, word("gallery.task.start"))
    : said("gallery.task.needs", { organ: TASK_ORGAN, command: `make -f Makefile.data ORGAN=${TASK_ORGAN}` }));
}

speak(chosenLanguage());
const bundles = await servedBundles(), studies = await servedStudies();
document.getElementById("studies")!.replaceChildren(...studies.flatMap(({ organ, boundary, report }) => [element("a", { href: report }, `${namedPath(organ)}, ${named(boundary)}`), " "]));
document.getElementById("none")!.hidden = bundles.length > 0;
show(bundles);
offerLanguages(() => show(bundles));
document.body.dataset.state = "ready";
