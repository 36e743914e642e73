// Wires and rolls x entry angles as one grid: force in color and number, outcome as a letter.
import {forceColor, gradient, inkOn} from "./colors.js";
import {el, section} from "./dom.js";
import {degrees, number, outcomeMark, outcomeWord, outcomes, planName, shown, wallOfScouts} from "./format.js";

const distinct = (values) => [...new Set(values)];

const entryKey = (t) => `${t.inclination_deg} ${t.azimuth_deg}`;
const columnKey = (t) => `${t.wire}\n${t.roll_deg}`;

export const heatSection = (page, selection) => {
  const {trials} = page;
  const reached = trials.filter((t) => t.reached && t.peak_contact_force_n !== null);
  const scale = Math.max(0, ...reached.map((t) => t.peak_contact_force_n));

  // Rows and columns in the order of the trials.
  const entries = new Map(trials.map((t) => [entryKey(t), t]));
  const columns = new Map(trials.map((t) => [columnKey(t), t]));
  // Of several ways to move one wire at one angle, the best ranked.
  const cells = new Map();
  for (const t of trials) {
    const key = `${entryKey(t)}\n${columnKey(t)}`, shown = cells.get(key);
    if (!shown || (t.plan && (!shown.plan || t.plan.rank < shown.plan.rank))) cells.set(key, t);
  }
  const wires = distinct(trials.map((t) => t.wire));
  const rollsOf = (wire) => [...columns.values()].filter((t) => t.wire === wire);

  const makeCell = (t) => {
    if (!t) return el("td", {class: "empty"});
    const ranked = Boolean(t.plan);
    const color = t.reached && scale > 0 ? forceColor(t.peak_contact_force_n / scale) : null;
    const rough = t.level !== "full";
    const text = (rough ? "\u2248" : "") +
      (t.reached ? `${number(t.peak_contact_force_n)}${ranked || rough ? "" : "\u2009!"}` : outcomeMark(t.outcome));
    const what = `${planName(t)}: ${outcomeWord(t.outcome)}, largest contact ${number(t.peak_contact_force_n)} N` +
      (rough ? ", by a coarse trial" : "") + (t.reached && !ranked ? `, not ranked: ${t.excluded ?? "coarse"}` : "");
    return el("td", {},
      el("button", {
        type: "button", tabindex: "-1", "data-trial": t.id, title: what,
        "aria-label": `${text}: ${what}`,  // what is seen must be in the name
        class: t.reached ? "cell" : "cell failed",
        style: color ? `background:${color};color:${inkOn(color)}` : null,
        onclick: () => selection.set(t.id),
      }, text));
  };

  const rows = [...entries].map(([entry, first]) =>
    el("tr", {},
      el("th", {scope: "row"}, `${degrees(first.inclination_deg)} / ${degrees(first.azimuth_deg)}`),
      [...columns.keys()].map((column) => makeCell(cells.get(`${entry}\n${column}`)))));
  const grid = el("table", {class: "heat", id: "heat-grid"},
    el("thead", {},
      el("tr", {}, el("th", {scope: "col"}, "Wire"),
        wires.map((wire) => el("th", {scope: "colgroup", colspan: rollsOf(wire).length}, el("bdi", {}, shown(wire))))),
      el("tr", {}, el("th", {scope: "col"}, "Inclination / azimuth; roll"),
        [...columns.values()].map((t) => el("th", {scope: "col"}, degrees(t.roll_deg))))),
    el("tbody", {}, rows));

  // One stop for the Tab key; arrows go from cell to cell.
  const buttons = [...grid.querySelectorAll("button")];
  const at = (button) => [button.closest("tr").rowIndex, button.closest("td").cellIndex];
  const focusOn = (button) => {
    for (const other of buttons) other.tabIndex = -1;
    button.tabIndex = 0;
    button.focus();
  };
  const moves = {ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0]};
  grid.addEventListener("keydown", (event) => {
    const move = moves[event.key];
    if (!move || !event.target.dataset.trial) return;
    event.preventDefault();
    let [row, column] = at(event.target);
    for (;;) {
      row += move[0];
      column += move[1];
      const cell = grid.rows[row]?.cells[column];
      if (!cell || cell.tagName === "TH") return;
      const button = cell.querySelector("button");
      if (button) return focusOn(button);
    }
  });
  selection.follow((id) => {
    for (const button of buttons) {
      const chosen = Number(button.dataset.trial) === id;
      button.setAttribute("aria-pressed", String(chosen));
      button.tabIndex = chosen ? 0 : -1;
    }
  });

  const seen = outcomes.filter((outcome) => trials.some((t) => t.outcome === outcome && outcome !== "reached"));
  return section("heat", "Wires and angles",
    el("p", {}, "Every trial: where the target was reached, the largest force on any 5 mm of wire in newtons (largest contact) with its color; else a letter for how it ended. Press a cell to see the trial."),
    el("div", {class: "legend"},
      el("span", {}, "reached, largest contact: 0"),
      el("span", {class: "bar", style: `background:${gradient()}`, role: "img", "aria-label": "color scale of the largest contact force"}),
      el("span", {}, scale > 0 ? `${number(scale)}\u00a0N` : "none reached")),
    el("ul", {class: "marks"},
      el("li", {}, el("b", {}, "!"), " reached, but not ranked"),
      trials.some((t) => t.level !== "full")
        ? el("li", {}, el("b", {}, "\u2248"), ` coarse trial: in ${wallOfScouts(page.report)}, most with long elements; forces are rough`) : null,
      seen.map((outcome) => el("li", {}, el("b", {}, outcomeMark(outcome)), ` ${outcomeWord(outcome)}`))),
    el("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": "Grid of wires and angles"}, grid),
    el("p", {class: "note"}, "Errors of these forces are in the table of plans; those marked \u00b1\u00a0? there were not estimated."));
};
