// The gallery: every bundle of the server's data folder, and the task of finding the hidden nodule.
import { element } from "./elements";
import { megabytes, servedBundles, viewerAddress, type ServedBundle } from "./served";

const TASK_ORGAN = "liver-tumour";

function card(bundle: ServedBundle): HTMLElement {
  const { organ, boundary, resolution, bytes, picture } = bundle;
  const facts = [["Held", boundary], ["Mesh", resolution], ["Size", `${megabytes(bytes)} MB`]];
  const shown = picture ? element("img", { src: picture, alt: `${organ}, and what holds it: ${boundary}`, loading: "lazy" }) : "No picture yet: make -f Makefile.data gallery draws one.";
  return element("li", {}, element("a", { href: viewerAddress(bundle) },
    element("div", { class: "picture" }, shown),
    element("div", { class: "about" }, element("h2", {}, organ), element("dl", {}, ...facts.flatMap(([term, value]) => [element("dt", {}, term), element("dd", {}, value)])))));
}

// The organ as it is, not one of the other materials of its folder, which lie in folders of longer names.
const taskBundle = (bundles: ServedBundle[]) => bundles.filter(({ organ }) => organ === TASK_ORGAN).sort((a, b) => a.boundary.length - b.boundary.length || a.bytes - b.bytes)[0];

const bundles = await servedBundles(), withNodule = taskBundle(bundles);
document.getElementById("organs")!.append(...bundles.map(card));
document.getElementById("none")!.hidden = bundles.length > 0;
document.getElementById("task-start")!.append(withNodule
  ? element("a", { class: "primary", href: viewerAddress(withNodule, { task: "nodule" }) }, "Start")
  : element("span", {}, "It needs the organ ", element("code", {}, TASK_ORGAN), ", which ", element("code", {}, `make -f Makefile.data ORGAN=${TASK_ORGAN}`), " makes."));
document.body.dataset.state = "ready";
