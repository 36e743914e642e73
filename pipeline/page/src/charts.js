// Charts, each with its numbers as a table for who cannot see it or wants to copy it.
import {dot, frame, gridX, gridY, line, plot, ruleX, ruleY, text} from "@observablehq/plot";
import {lineColors} from "./colors.js";
import {el, section, table} from "./dom.js";
import {number, percent, planName, withError} from "./format.js";

const kHeight = 340;

/** A figure that draws itself to the width it has. `make(width)` gives the chart or null. */
const figure = (caption, make, numbers) => {
  const holder = el("div", {class: "chart"});
  const node = el("figure", {}, holder, el("figcaption", {}, caption), numbers);
  let width = 0;
  const draw = () => holder.replaceChildren(...[make(width)].filter(Boolean));
  new ResizeObserver(() => {
    const now = Math.min(760, Math.floor(holder.clientWidth));
    if (now === width || now === 0) return;
    width = now;
    draw();
  }).observe(holder);
  return {node, draw: () => width && draw()};
};

const chart = (label, options) => {
  const node = plot({
    height: kHeight,
    marginLeft: 56,
    marginBottom: 44,
    marginRight: 30,
    style: {fontSize: "13px", background: "transparent", color: "#1b1b1b"},
    ...options,
  });
  // One picture with one name: its parts have no roles, so their names are taken off.
  for (const part of node.querySelectorAll("[aria-label], [aria-description]")) {
    part.removeAttribute("aria-label");
    part.removeAttribute("aria-description");
  }
  node.setAttribute("role", "img");
  node.setAttribute("aria-label", label);
  return node;
};

const numbersOf = (label, head, rows) =>
  el("details", {}, el("summary", {}, `Numbers: ${label}`), table(label, head, rows));

// ---- Force over insertion.
const kPeak = {of: (p) => p.peak, name: "largest contact", color: 0, dash: null};
const kTotal = {of: (p) => p.total, name: "all contacts", color: 3, dash: "9 3 2 3"};
const kForces = [
  kPeak,
  {of: (p) => p.push, name: "hand", color: 1, dash: "7 4"},
  {of: (p) => p.tip, name: "tip", color: 2, dash: "2 3"},
  kTotal,
];
const kToolForces = [
  kPeak,
  ...["catheter", "wire"].flatMap((name, k) => [
    {of: (p) => p.tools[k].push, name: `hand on the ${name}`, color: 1 + k, dash: "7 4"},
    {of: (p) => p.tools[k].tip, name: `tip of the ${name}`, color: 1 + k, dash: "2 3"},
  ]),
  kTotal,
];
/** Of a trial: those of each tool, where it has several. */
const forcesOf = (trial) => (trial.pushes()[0]?.tools ? kToolForces : kForces);

const keyOf = ({name, color, dash}) => {
  const key = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  key.setAttribute("width", "34");
  key.setAttribute("height", "10");
  key.setAttribute("aria-hidden", "true");
  const stroke = document.createElementNS("http://www.w3.org/2000/svg", "path");
  stroke.setAttribute("d", "M0 5H34");
  stroke.setAttribute("stroke", lineColors[color]);
  stroke.setAttribute("stroke-width", "3");
  if (dash) stroke.setAttribute("stroke-dasharray", dash);
  key.append(stroke);
  return el("li", {}, key, ` ${name}`);
};

const forceFigure = (page, selection) => {
  const title = el("span", {});
  const details = el("details", {}, el("summary", {}, "Numbers: force over insertion, every 10 mm"));
  const make = (width) => {
    const trial = page.trials[selection.get()];
    const pushes = trial.pushes();
    if (!pushes.length) return el("p", {}, "This wire never entered the vessel.");
    const forces = forcesOf(trial);
    const rows = forces.flatMap(({of, name}) => pushes.map((p) => ({x: p.way, y: of(p), name})));
    return chart(`Forces over the insertion of ${planName(trial)}`, {
      width,
      x: {label: `${trial.script ? "way of the hand, in and back" : "insertion"} [mm] \u2192`, nice: true},
      y: {label: "\u2191 force [N]", nice: true},
      marks: [
        gridX(), gridY(), ruleY([0]),
        forces.map(({name, color, dash}) =>
          line(rows.filter((r) => r.name === name), {x: "x", y: "y", stroke: lineColors[color], strokeWidth: 2, strokeDasharray: dash})),
      ],
    });
  };
  const legend = el("ul", {class: "keys"});
  const shown = figure(
    el("span", {}, el("b", {}, "Force over insertion"), ": ", title, legend), make, details);
  selection.follow((id) => {
    const trial = page.trials[id];
    const {peak_contact_force_error_n: error} = trial.errors;
    title.textContent = `${planName(trial)}; largest contact ${withError(trial.peak_contact_force_n, error)}\u00a0N.`;
    const forces = forcesOf(trial);
    legend.replaceChildren(...forces.map(keyOf));
    const every = trial.pushes().filter((p, k, all) => k === all.length - 1 || Math.floor(p.way / 10) > Math.floor((all[k - 1]?.way ?? 0) / 10));
    details.replaceChildren(details.firstChild,
      table("Force over insertion", ["Insertion [mm]", ...forces.map(({name}) => `${name} [N]`)],
        every.map((p) => [number(p.insertion), ...forces.map(({of}) => number(of(p)))])));
    shown.draw();
  });
  return shown.node;
};

// ---- Pareto front.
const paretoFigure = (page, selection) => {
  // At a cross-section a plan passes or does not: what counts besides force is how often it is safe.
  const goal = page.targetRadius, section = page.atSection;
  const title = section ? "safe share" : "reach margin", unit = section ? "%" : "mm";
  const rows = page.trials.filter((t) => t.plan).map((t) => ({
    id: t.id, trial: t,
    x: t.peak_contact_force_n, xError: t.errors.peak_contact_force_error_n ?? null,
    y: section ? 100 * t.plan.expected_success_rate : goal - t.tip_to_target_mm,
    yError: section ? null : t.errors.position_error_mm ?? null,
    front: page.report.pareto.includes(t.id),
  }));
  if (!rows.length) return el("p", {}, "Pareto front: no plan is ranked, so there is none.");
  const front = rows.filter((r) => r.front).sort((a, b) => a.x - b.x);
  const make = (width) => chart(`Largest contact force against ${title} of every ranked plan`, {
    width,
    x: {label: "largest contact [N] \u2192", nice: true, zero: true},
    y: {label: `\u2191 ${title} [${unit}]`, nice: !section, zero: true, ...(section ? {domain: [0, 100]} : {})},
    marks: [
      gridX(), gridY(),
      line(front, {x: "x", y: "y", stroke: lineColors[1], strokeWidth: 1.5, strokeDasharray: "5 4"}),
      ruleY(rows.filter((r) => r.xError !== null), {y: "y", x1: (r) => r.x - r.xError, x2: (r) => r.x + r.xError, stroke: "#333"}),
      ruleX(rows.filter((r) => r.yError !== null), {x: "x", y1: (r) => r.y - r.yError, y2: (r) => r.y + r.yError, stroke: "#333"}),
      dot(rows.filter((r) => !r.front), {x: "x", y: "y", r: 4, stroke: lineColors[0], strokeWidth: 1.5, title: (r) => planName(r.trial)}),
      dot(front, {x: "x", y: "y", r: 6, symbol: "diamond", fill: lineColors[1], title: (r) => planName(r.trial)}),
      dot(rows.filter((r) => r.id === selection.get()), {x: "x", y: "y", r: 10, stroke: "#000", strokeWidth: 2}),
      text(front, {x: "x", y: "y", dy: -13, text: (r) => `plan ${r.trial.plan.rank}`, fontWeight: "bold"}),
    ],
  });
  const shown = figure(
    el("span", {}, el("b", {}, "Pareto front"), `: filled diamonds are plans that no other beats in both force and ${section ? "safe share (of a plan that was not repeated, what the repeated ones make likely)" : `reach margin (target radius ${number(goal)} mm less the tip's distance)`}. Bars are numerical errors, where estimated; the ring is the chosen plan.`),
    make,
    numbersOf("Pareto front", ["Plan", "Largest contact [N]", `${section ? "Safe share" : "Reach margin"} [${unit}]`],
      front.map((r) => [`${r.trial.plan.rank}: ${planName(r.trial)}`, withError(r.x, r.xError), section ? number(r.y) : withError(r.y, r.yError)])));
  selection.follow(() => shown.draw());
  return shown.node;
};

// ---- Success rates.
const successFigure = (page) => {
  const rows = page.report.ranking
    .filter((p) => p.success_rate !== null && p.success_rate !== undefined)
    .map((p) => ({rank: `plan ${p.rank}`, rate: p.success_rate, low: p.success_rate_interval[0], high: p.success_rate_interval[1], trial: page.trials[p.trial]}));
  if (!rows.length) {
    return el("figure", {}, el("p", {class: "missing"},
      el("b", {}, "Safe share: "),
      `none. No plan was repeated with disturbed angles, friction and wall, so how robust they are is not known. A case asks for repeats with robustness.repeats.`));
  }
  const make = (width) => chart("Share of safe repeats of each repeated plan with its interval", {
    width,
    height: 60 + 26 * rows.length,
    marginLeft: 76,
    x: {label: "safe repeats [%] \u2192", domain: [0, 100]},
    y: {label: null, domain: rows.map((r) => r.rank)},
    marks: [
      gridX(), frame({stroke: "#bbb"}),
      ruleY(rows, {y: "rank", x1: (r) => 100 * r.low, x2: (r) => 100 * r.high, stroke: lineColors[0], strokeWidth: 3}),
      dot(rows, {x: (r) => 100 * r.rate, y: "rank", r: 6, fill: lineColors[1]}),
    ],
  });
  return figure(
    el("span", {}, el("b", {}, "Safe share"), " over repeats with disturbed angles, friction and wall; bars are their intervals."),
    make,
    numbersOf("Safe share", ["Plan", "Safe share", "Interval"],
      rows.map((r) => [`${r.rank}: ${planName(r.trial)}`, percent(r.rate), `${percent(r.low)} to ${percent(r.high)}`]))).node;
};

// ---- Error against run time.
/** The powers of ten round the values, as the domain of a logarithmic axis. */
const span = (values) => ({
  domain: [10 ** Math.floor(Math.log10(Math.min(...values))), 10 ** Math.ceil(Math.log10(Math.max(...values)) + 1e-9)],
});
/** 1, 2 and 5 of every power of ten have a number, what is between them has none. */
const decade = (value) => ([1, 2, 5].includes(Math.round(value / 10 ** Math.floor(Math.log10(value) + 1e-9))) ? number(value) : "");

const numericsFigure = (page) => {
  const times = new Map((page.timing.numerics ?? []).map((r) => [`${r.trial} ${r.element_length_mm}`, r.cpu_s]));
  const rows = page.report.numerics.rows
    .map((r) => ({...r, cpu: times.get(`${r.trial} ${r.element_length_mm}`) ?? null, name: page.trials[r.trial].plan ? `plan ${page.trials[r.trial].plan.rank}` : `trial ${r.trial}`}));
  const drawn = rows.filter((r) => r.cpu > 0 && r.position_error_mm > 0);
  if (!drawn.length) return el("p", {}, "Error against run time: no plan was run with finer and coarser elements.");
  const names = [...new Set(drawn.map((r) => r.name))];
  const make = (width) => chart("Position error against run time for elements of several lengths", {
    width,
    x: {label: "processor time of one insertion [s] \u2192", type: "log", tickFormat: decade, ...span(drawn.map((r) => r.cpu))},
    y: {label: "\u2191 position error [mm]", type: "log", tickFormat: decade, ...span(drawn.map((r) => r.position_error_mm))},
    marks: [
      gridX(), gridY(),
      names.map((name, k) => [
        line(drawn.filter((r) => r.name === name), {x: "cpu", y: "position_error_mm", stroke: lineColors[k % lineColors.length], strokeWidth: 1.5}),
        dot(drawn.filter((r) => r.name === name), {x: "cpu", y: "position_error_mm", r: 5, fill: lineColors[k % lineColors.length], symbol: ["circle", "square", "triangle", "diamond", "star"][k % 5]}),
      ]),
      // Names of neighbouring lines on different sides.
      names.map((name, k) => text(drawn.filter((r) => r.name === name), {
        x: "cpu", y: "position_error_mm", dx: k % 2 ? -9 : 9, dy: 12 * (Math.floor(k / 2) % 2),
        textAnchor: k % 2 ? "end" : "start", text: (r) => `${number(r.element_length_mm)} mm`})),
    ],
  });
  return figure(
    el("span", {}, el("b", {}, "Error against run time"), ` of this case: position error of the final shape by element length (${names.map((name, k) => `${["circle", "square", "triangle", "diamond", "star"][k % 5]} ${name}`).join(", ")}).`),
    make,
    numbersOf("Error against run time", ["Plan", "Element length [mm]", "Position error [mm]", "Largest contact [N]", "Processor time [s]"],
      rows.map((r) => [r.name, number(r.element_length_mm), number(r.position_error_mm), number(r.peak_contact_force_n), number(r.cpu)]))).node;
};

export const chartSection = (page, selection) =>
  section("charts", "Charts",
    el("div", {class: "figures"},
      forceFigure(page, selection), paretoFigure(page, selection), successFigure(page), numericsFigure(page)));
