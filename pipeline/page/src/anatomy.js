// Access, C-arm angles and lengths: what the way is like before a wire is pushed.
import {el, facts, name, section, svg, table} from "./dom.js";
import {degrees, number, percent, shown} from "./format.js";

const mm = (value) => `${number(value)}\u00a0mm`;
export const place = (p) => `(${p.map((x) => (Math.round(10 * x) / 10 + 0).toFixed(1)).join(", ")})\u00a0mm`;

// ---- Access.
const thresholds = (from, [mild, moderate, severe]) =>
  `mild ${from} ${mild}, moderate ${from} ${moderate}, severe ${from} ${severe}`;

/** Whether a device passes: a lumen may be wide enough one way alone. */
export const fitText = (row) =>
  !row.fits ? "does not fit" : row.oval ? "fits where the lumen, oval there, gives way" : "fits";

const passageRow = (what, row) => [
  what,
  `least lumen ${mm(row.lumen_diameter_mm)} (sphere inside ${mm(row.inscribed_diameter_mm)}), ${mm(row.at_mm)} from the access at ${place(row.place_mm)}`,
  `device over lumen below ${number(row.max_ratio)}`,
  `${row.assumed_longer_than_way ? "not weighed, since assumed and longer than the way" : fitText(row)}: ${mm(row.device_diameter_mm)} in ${mm(row.lumen_diameter_mm)} is ${number(row.ratio)}`,
  shown(row.source),
];

const tortuosityText = (index) =>
  index < 1.005 ? "the way is straight (1.00 times the straight line)" : `the way is ${number(index)} times as long as the straight line between its ends`;

const accessTable = ({device, sheath, tortuosity, sharpest_bend: bend, calcium}) =>
  table("Access", ["What", "Found", "Held against", "Verdict", "Source"], [
    passageRow("Device, along the whole way", device),
    passageRow(`Sheath, in the first ${mm(sheath.length_mm)}`, sheath),
    ["Tortuosity",
     tortuosity.index === null ? shown(tortuosity.null_reasons.index) : tortuosityText(tortuosity.index),
     thresholds("from", tortuosity.thresholds.map(number)),
     tortuosity.grade, shown(tortuosity.source)],
    ["Sharpest bend",
     `${degrees(bend.angle_deg)} between its arms of ${mm(bend.arm_mm)} (180\u00b0 is straight), ${mm(bend.at_mm)} from the access at ${place(bend.place_mm)}${bend.at_ostium_of ? `, where the way turns into ${bend.at_ostium_of}: an ostium's turn, no bend of the access vessels` : ""}`,
     thresholds("down from", bend.thresholds_deg.map(degrees)),
     bend.grade, shown(bend.source)],
    ["Calcium in and beside the lumen",
     calcium.volume_mm3 === null ? `not known: ${shown(calcium.null_reasons.volume_mm3)}` : `${number(calcium.volume_mm3)}\u00a0mm\u00b3`,
     `voxels above ${number(calcium.above_hu)}\u00a0HU in the lumen and within ${mm(calcium.within_mm)} of it`,
     calcium.volume_mm3 === null ? "not known" : `${calcium.volume_mm3 > 0 ? "look at the slices: bone and metal (stents) beside the lumen count too" : "none found"}; blur hides most of thin plaque`,
     shown(calcium.source)],
  ]);

// ---- C-arm.
const viewText = (view, [branch, trunk] = ["branch", "trunk"]) => {
  if (!view) return "none";
  const short = (part, what) => (part < 0.005 ? `${what} in full length` : `${what} ${percent(part)} too short`);
  return `${view.view}: ${short(view.branch_foreshortening, branch)}, ${short(view.trunk_foreshortening, trunk)}` +
    (view.reachable ? "" : "; out of the C-arm's reach");
};

const armTable = ({ostia, bend}) =>
  table("C-arm angles", ["Place", "From the access", "Turn", "Best view", "Second best"], [
    ...ostia.map((row) => [
      `from ${shown(row.trunk)} into ${shown(row.branch)}`, mm(row.at_mm), degrees(row.turn_deg), viewText(row.best), viewText(row.second)]),
    ...(bend.best ? [["the sharpest bend", mm(bend.at_mm), "\u2013", ...[bend.best, bend.second].map((view) => viewText(view, ["far arm", "near arm"]))]] : [])]);

const kFromTheFront = {view: "LAO 0, CRA 0", lao_deg: 0, cranial_deg: 0};
const kAxes = ["first", "second", "third"];

/** The ostium to work at: that of the target's branch, where the way turns into it. */
export const workingOstium = ({ostia}) => ostia.findLast((row) => row.leads_to_target ?? row === ostia.at(-1));

/** Where the input's axes are not the patient's: along the one in which the vessel reaches least; the one in which it reaches furthest stands upright, the access below. */
const alongAnAxis = ({tree, way}) => {
  const points = [...tree, way].flatMap((line) => line.points);
  const reach = kAxes.map((_, k) => points.reduce((most, p) => Math.max(most, p[k]), -Infinity) - points.reduce((least, p) => Math.min(least, p[k]), Infinity));
  const [least, middle, most] = [0, 1, 2].sort((j, k) => reach[j] - reach[k]);
  const unit = (axis, length) => kAxes.map((_, k) => (k === axis ? length : 0));
  return {view: `along the ${kAxes[least]} axis of the input`, right: unit(middle, 1), up: unit(most, way.points.at(-1)[most] < way.points[0][most] ? -1 : 1)};
};

/** The view to work in at an ostium: the best that the arm reaches; from the front without one; along an axis where the axes are not the patient's. */
export const workingView = (arm, ostium, panel) => {
  if (arm.no_views) return alongAnAxis(panel);
  if (!ostium?.best) return kFromTheFront;
  return ostium.best.reachable || !ostium.second ? ostium.best : ostium.second;
};

/** The picture's axes in space, as unit vectors: of a C-arm's view, or as the view has them. */
const axesOf = (view) => {
  if (view.up) return view;
  const a = (view.lao_deg * Math.PI) / 180, b = (view.cranial_deg * Math.PI) / 180;
  return {right: [Math.cos(a), Math.sin(a), 0], up: [-Math.sin(a) * Math.sin(b), Math.cos(a) * Math.sin(b), Math.cos(b)]};
};

/**
 * The tree and the way as the detector of that view sees them, in mm. `marks`: the wire's nodes, in
 * whose place the middle of the way is drawn without; an ostium; access and target.
 */
export const drawView = ({tree, way}, view, marks) => {
  const {right, up} = axesOf(view);
  const dot = (u, p) => u[0] * p[0] + u[1] * p[1] + u[2] * p[2];
  const seen = (p) => [dot(right, p), -dot(up, p)];
  const round = (x) => x.toFixed(1);

  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const strokes = (line, color) => line.points.slice(1).map((p, k) => {
    const [x1, y1] = seen(line.points[k]), [x2, y2] = seen(p), width = line.radius[k] + line.radius[k + 1];
    box[0] = Math.min(box[0], x1 - width, x2 - width);
    box[1] = Math.min(box[1], y1 - width, y2 - width);
    box[2] = Math.max(box[2], x1 + width, x2 + width);
    box[3] = Math.max(box[3], y1 + width, y2 + width);
    return svg("line", {x1: round(x1), y1: round(y1), x2: round(x2), y2: round(y2), stroke: color, "stroke-width": round(width), "stroke-linecap": "round"});
  });
  const lumen = [...tree.flatMap((line) => strokes(line, "#c9ced6")), ...strokes(way, "#8fb3d9")];
  const unit = Math.max(box[2] - box[0], box[3] - box[1]) / 400;  // of marks and letters
  const line = (points, color, width) =>
    svg("polyline", {points: points.map((p) => seen(p).map(round).join(",")).join(" "), fill: "none", stroke: color, "stroke-width": width * unit});
  const middle = marks.wire?.length ? line(marks.wire, "#a3262a", 1.4) : line(way.points, "#1b1b1b", 0.8);
  const taken = [];  // by letters: middle, width and height
  const label = (p, text, size) => {
    const [x, foot] = seen(p), width = 0.7 * size * unit * text.length, height = size * unit;
    const meets = (y) => taken.some((other) => Math.abs(x - other.x) < (width + other.width) / 2 && Math.abs(y - other.y) < (height + other.height) / 2);
    let y = foot;
    while (meets(y)) y += height / 4;
    taken.push({x, y, width, height});
    return svg("text", {x: round(x), y: round(y), "font-size": size * unit, "text-anchor": "middle", fill: "#1b1b1b", stroke: "#ffffff", "stroke-width": (size * unit) / 5, "paint-order": "stroke"}, text);
  };
  const ends = [["A", marks.access], ["T", marks.target]].filter(([, p]) => p).map(([text, p]) => label(p, text, 15));
  const names = tree.map((branch, k) => label(branch.points.at(-1), String(k + 1), 10));
  const circle = (p) => {
    const [x, y] = seen(p);
    return svg("circle", {cx: round(x), cy: round(y), r: 6 * unit, fill: "none", stroke: "#a3262a", "stroke-width": 1.4 * unit});
  };
  const pad = 8 * unit;
  const viewBox = [box[0] - pad, box[1] - pad, box[2] - box[0] + 2 * pad, box[3] - box[1] + 2 * pad].map(round).join(" ");
  const what = `Vessel and way in the view ${view.view}${marks.ostium ? ", the ostium circled" : ""}`;
  return svg("svg", {class: "arm-view", viewBox, preserveAspectRatio: "xMidYMin meet", role: "img", "aria-label": what},
    lumen, middle, names, ends, marks.ostium ? circle(marks.ostium) : null);
};

const pictureOf = (arm, panel, ostium) => {
  const view = workingView(arm, ostium, panel);
  return el("figure", {},
    drawView(panel, view, {ostium: ostium.place_mm}),
    el("figcaption", {}, `${arm.no_views ? `Seen ${view.view}` : `${view.view}, as the detector sees it`}: the way blue, the vessels beside it grey, as wide as their lumen, each branch with its number at its end; the ostium of ${ostium.branch} circled.`));
};

// ---- Lengths.
const lengthTable = ({places}) =>
  table("Lengths along the way", ["Place", "From the access"],
    places.map(({what, branch, at_mm: at}) => [branch ? `${what} ${shown(branch)}` : what, mm(at)]));

const wireSentence = (row) =>
  [name(shown(row.wire)), `: ${mm(row.length_mm)}, ${row.long_enough ? `long enough, ${mm(row.spare_mm)} to spare` : `too short by ${mm(-row.spare_mm)}`}`];

const lengthFacts = (lengths) =>
  facts([
    ["Way from access to target", mm(lengths.way_mm)],
    ["Wire needed", `${mm(lengths.wire_needed_mm)}: the way, ${lengths.catheter ? `${shown(lengths.catheter)} of` : "a catheter of"} ${mm(lengths.catheter_mm)} and ${mm(lengths.working_mm)} to hold`],
    ["Assumed", shown(lengths.assumption)],
    ["Wires of the case", el("ul", {}, lengths.wires.map((row) => el("li", {}, wireSentence(row))))],
  ]);

export const anatomySection = (page) => {
  const {anatomy} = page.report;
  if (!anatomy) return null;
  const {access, c_arm: arm, lengths} = anatomy;
  const {ostia} = arm;
  return section("anatomy", "Access, C-arm angles and lengths",
    el("p", {class: "note"}, "Measured on the middle of the lumen; no wire is simulated for it. Branches are numbered as the tree of the vessel is (tree.vtp)."),
    el("h3", {}, "Access"), accessTable(access),
    el("h3", {}, "C-arm angles"),
    ostia.length
      ? [arm.no_views ? el("p", {}, `No C-arm angles: ${shown(arm.no_views)}.`) : el("p", {}, `Views that show a vessel and the branch that the way takes in their length, for a patient who lies straight on the back. LAO turns the detector to the patient's left, RAO to the right, CRA to the head, CAU to the feet. Within reach is ${degrees(arm.max_rotation_deg)} to either side and ${degrees(arm.max_tilt_deg)} up or down (${shown(arm.source)}).`),
         armTable(arm),
         page.panels.anatomy ? ostia.map((ostium) => pictureOf(arm, page.panels.anatomy, ostium)) : null].flat()
      : el("p", {}, "The way leaves no vessel for a branch, so no ostium asks for a view of its own."),
    el("h3", {}, "Lengths and wires"), lengthTable(lengths), lengthFacts(lengths));
};
