// In: names, properties, children. Out: elements; strings become text, never markup.

/**
 * Creates an HTML element; a property `on…` adds an event listener.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, any>} [props]
 * @param {...any} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function h(tag, props = {}, ...children) {
  const e = document.createElement(tag);
  set(e, props);
  e.append(
    ...children
      .flat(3)
      .filter((c) => c !== null && c !== undefined && c !== false)
      .map(asNode),
  );
  return e;
}

/** Creates an SVG element. */
export function svg(tag, props = {}, ...children) {
  const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [k, v] of Object.entries(props)) if (v !== undefined) e.setAttribute(k, String(v));
  e.append(...children.flat(3).filter(Boolean).map(asNode));
  return e;
}

/** All elements below `root` that match a selector. @returns {HTMLElement[]} */
export const all = (root, selector) => [...root.querySelectorAll(selector)];

const asNode = (c) => (c instanceof Node ? c : document.createTextNode(String(c)));

function set(e, props) {
  for (const [k, v] of Object.entries(props)) {
    if (v === undefined || v === null || v === false) continue;
    if (k.startsWith("on")) e.addEventListener(k.slice(2), v);
    else if (k in e && typeof v !== "string") e[k] = v;
    else e.setAttribute(k, v === true ? "" : String(v));
  }
}

/** Replaces the children of an element. */
export function fill(e, ...children) {
  e.replaceChildren(
    ...children
      .flat(3)
      .filter((c) => c !== null && c !== undefined && c !== false)
      .map(asNode),
  );
  return e;
}

/** A number as text: `digits` digits after the point, or a dash if there is no finite number. */
export function num(value, digits = 3, unit = "") {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return value.toFixed(digits) + (unit ? "\u00a0" + unit : "");
}

/** A value ± its standard deviation, rounded to two significant digits of the deviation. */
export function withSigma(value, sigma, unit) {
  if (!Number.isFinite(value)) return "–";
  const digits = sigma > 0 ? Math.min(5, Math.max(0, 1 - Math.floor(Math.log10(sigma)))) : 3;
  return `${value.toFixed(digits)}\u00a0±\u00a0${(sigma || 0).toFixed(digits)}\u00a0${unit}`;
}

export const thousands = (n) => (n ?? 0).toString().replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f");
