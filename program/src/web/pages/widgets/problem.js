// In: a fault. Out: its four sentences, shown where it happened or in a corner.

import { fill, h } from "../base/dom.js";
import { t } from "../base/text.js";
import { on } from "../base/store.js";

/** An element that shows a fault, for use beside the place where it happened. */
export function fault(e) {
  const p = e.problem ?? e;
  if (!p.what) console.warn(e);
  return h(
    "div",
    { class: "problem", role: "alert" },
    h("b", {}, p.what ?? e.message ?? String(e)),
    p.cause && h("div", { class: "small" }, `${t("Likely cause")}: ${p.cause}`),
    p.next && h("div", { class: "small" }, `${t("Next")}: ${p.next}`),
  );
}

on("problem", (e) => {
  const toast = document.getElementById("toast");
  const one = h("div", {}, fault(e));
  toast.append(one);
  setTimeout(() => one.remove(), 9000);
  if (toast.children.length > 3) toast.firstChild.remove();
});

/** Runs the action of a button. A fault is shown in `place`, or in the corner without `place`. */
export async function attempt(what, place) {
  if (place) fill(place);
  try {
    return await what();
  } catch (e) {
    if (place) fill(place, fault(e));
    else {
      const { tell } = await import("../base/store.js");
      tell("problem", e);
    }
    return undefined;
  }
}
