// Elements with attributes and children. Text always becomes a text node, so no name is ever HTML.

const kSvg = "http://www.w3.org/2000/svg";

const fill = (node, attributes, children) => {
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (value === true) node.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(key, value);
  }
  for (const child of children.flat()) {
    if (child !== null && child !== undefined) node.append(child);
  }
  return node;
};

export const el = (tag, attributes = {}, ...children) =>
  fill(document.createElement(tag), attributes, children);

export const svg = (tag, attributes = {}, ...children) =>
  fill(document.createElementNS(kSvg, tag), attributes, children);

/** A section with its heading, to be found by the page's list of contents. */
export const section = (id, title, ...children) =>
  el("section", {id, "aria-labelledby": `${id}-title`}, el("h2", {id: `${id}-title`}, title), ...children);

/** A table in a frame that scrolls sideways and that the keyboard reaches. */
export const table = (label, head, rows) =>
  el(
    "div",
    {class: "scroll", tabindex: "0", role: "region", "aria-label": label},
    el(
      "table",
      {},
      el("thead", {}, el("tr", {}, head.map((cell) => el("th", {scope: "col"}, cell)))),
      el("tbody", {}, rows.map((row) => el("tr", {}, row.map((cell) => el("td", {}, cell))))),
    ),
  );

/** Names and what they are, as a list. */
export const facts = (pairs) =>
  el("dl", {class: "facts"}, pairs.map(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]).flat());

/** A name given by somebody else, kept from turning the text round it. */
export const name = (text) => el("bdi", {}, text);
