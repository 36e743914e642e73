// The first sheet: what is needed to decide and to prepare, on one A4 page. It has the size of the
// page on paper also on a screen, so that what fits here fits there.
import {el, name} from "./dom.js";
import {degrees, number, plural, shown, toolsName, valueName} from "./format.js";
import {drawView, fitText, workingOstium, workingView} from "./anatomy.js";

const kPlans = 3, kReasons = 8, kChanges = 4, kWarnings = 3, kPlaces = 6;
const kAnswers = {
  feasible: "Feasible",
  feasible_with_risk: "Feasible with risk",
  unsure: "Unsure",
  not_feasible: "Not feasible",
};
/** The access and the target of a case that has several. */
const sectionText = ({provenance: {parameters: {section}}}) => {
  const parts = [section?.access, section?.target].filter(Boolean).map(shown);
  return parts.length ? `, ${parts.join(" to ")}` : "";
};

export const answerName = (answer) => kAnswers[answer] ?? shown(answer);
const kUnknowns = {
  friction: "friction",
  stiffness: "stiffness of the wire",
  wall: "stiffness of the wall",
  angle: "angle of the introducer",
  entry: "place of entry",
  lumen: "width of the lumen",
  support: "support of the vessel",
};

const two = (value) => number(Number(value.toPrecision(2)));
const wholePercent = (part) => `${Math.round(100 * part)}\u00a0%`;
export const sentence = (text) => shown(text).replace(/ deg\b/g, "\u00b0");
const mm = (value) => `${number(value)}\u00a0mm`;
/** A place on the way: whole millimetres, as far as they tell something. */
const along = (value) => mm(value < 10 ? Number(value.toFixed(1)) : Math.round(value));
const block = (id, title, ...children) =>
  el("section", {class: "block", id: `sheet-${id}`, "aria-label": title}, el("h2", {}, title), ...children);

/** On a narrow screen it scrolls sideways. */
const sheetTable = (label, heads, rows) =>
  el("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": label},
    el("table", {},
      el("thead", {}, el("tr", {}, heads.map((head) => (head ? el("th", {scope: "col"}, head) : el("td", {}))))),
      el("tbody", {}, rows.map((row) => el("tr", {}, row)))));

/** A list that can be cut from its end: what is left out is counted, and stands below the sheet. */
const cutList = (items, most) => {
  const kept = items.slice(0, most).map((item) => el("li", {}, item));
  const more = el("li", {class: "more"});
  const list = el("ul", {}, kept, more);
  const tell = () => {
    const left = items.length - kept.length;
    more.textContent = left ? `${left} more below.` : "";
    more.hidden = !left;
  };
  tell();
  const gone = [];
  list.cut = () => {
    if (kept.length < 2) return false;
    gone.push(kept.pop());
    gone.at(-1).remove();
    tell();
    return true;
  };
  list.uncut = () => {
    if (!gone.length) return false;
    kept.push(gone.pop());
    more.before(kept.at(-1));
    tell();
    return true;
  };
  return list;
};

// ---- Plans.
const kLong = new Set([1]);  // the column of wires
const safeText = (repeats) => (repeats ? `${repeats.successes} of ${repeats.repeats}` : "not repeated");

/** All steps of a script, each with the C-arm's view of the place that its tip is next to. */
const stepList = (plan, rank) => {
  const steps = plan.step_views ?? [{text: plan.script, view: null}];
  const seen = steps.map((step) => (step.view ? `${step.view}, ${shown(step.at)}` : ""));
  const same = seen.every((view) => view === seen[0]);
  const text = steps.map((step, k) => `${steps.length > 1 ? `${k + 1}. ` : ""}${sentence(step.text)}${same || !seen[k] ? "" : ` [${seen[k]}]`}`);
  const others = (plan.steps ?? []).map((step, k) => (step.otherwise ? ` Step ${k + 1}: ${sentence(step.otherwise)}` : ""));
  return el("p", {class: "steps"}, el("strong", {}, `Steps of plan ${rank}${same && seen[0] ? ` [${seen[0]}]` : ""}: `), text.join("; "), ".", others.join(""));
};

const planTable = ({report, trials}) => {
  const {tip_force_warn_n: warn} = report.provenance.parameters.limits ?? {};
  const plans = report.ranking.slice(0, kPlans);
  const heads = ["", plans.some((plan) => plan.catheter) ? "Wire and catheter" : "Wire", "Tilt", "Toward", "Roll", "Moves", "Wire in vessel", "Force at tip", "Largest force on wall", "Safe repeats"];
  const rows = plans.map((plan, k) => {
    const t = trials[plan.trial];
    return [`${k + 1}`, name(toolsName(t)), degrees(t.inclination_deg), degrees(t.azimuth_deg), degrees(t.roll_deg),
      t.script ? "steps below" : "one push", mm(t.insertion_mm), `${two(t.peak_tip_force_n)}\u00a0N`,
      `${two(t.peak_contact_force_n)}\u00a0N`, safeText(report.robustness?.plans?.find((row) => row.trial === plan.trial))];
  });
  const front = report.anatomy?.c_arm.no_views ? "-y of the input" : "the patient's front";
  const note = `Tilt of the introducer from the vessel's axis at the access, toward ${front} at 0\u00b0 and on from there right-handed about the axis into the vessel. Roll: how far the hub is turned before the first push, right-handed about the wire (clockwise as the hand sees it); at 0\u00b0 a bent tip points to ${front}. Safe: the target is reached and no limit is broken.` +
    (plans.some((plan) => plan.catheter) ? " Steps: millimetres count from the access point, turns are as the hand sees them; where a tip looks is as seen along the trunk, the way on from the access." : "") +
    (warn === undefined ? "" : ` Force at the tip: a warning from ${number(warn)}\u00a0N on.`);
  const {answer} = report.verdict ?? {};
  const title = answer === undefined || answer.startsWith("feasible")
    ? `The best of ${plural(report.ranking.length, "safe plan")}`
    : `${plural(report.ranking.length, "plan")} within all limits where nothing is disturbed${rows.length < report.ranking.length ? `, the first ${rows.length}` : ""}`;
  return block("plans", rows.length ? title : "Plans",
    rows.length
      ? [sheetTable("Best plans", heads, rows.map((row) => row.map((cell, k) =>
          kLong.has(k) ? el("td", {}, el("div", {class: "two-lines"}, cell)) : el("td", {class: "short"}, cell)))),
         ...plans.filter((plan) => plan.script).map((plan) => stepList(plan, plan.rank)),
         el("p", {class: "note"}, note)]
      : el("p", {}, "No plan reaches the target within the limits. The table of all trials below tells each one's end."));
};

// ---- Access.
const passageRow = (what, row) => [what, `lumen of ${mm(row.lumen_diameter_mm)} at its narrowest (sphere inside ${mm(row.inscribed_diameter_mm)}), ${along(row.at_mm)} in`,
  `${mm(row.device_diameter_mm)}, ratio ${number(Number(row.ratio.toFixed(2)))}`, `below ${number(row.max_ratio)}`, fitText(row)];

const accessTable = ({anatomy}) => {
  if (!anatomy) return block("access", "Access", el("p", {}, "Not measured in this report."));
  const {device, sheath, tortuosity, sharpest_bend: bend, calcium} = anatomy.access;
  const severe = (rows) => rows.at(-1);
  const rows = [
    passageRow("Device", device),
    sheath.assumed_longer_than_way
      ? [`Sheath of ${mm(sheath.length_mm)}`, "assumed, and longer than the way", "\u2013", "\u2013", "not weighed"]
      : passageRow(`Sheath, first ${mm(sheath.length_mm)}`, sheath),
    ["Tortuosity", tortuosity.index === null ? "not known" : `way over straight line`, number(tortuosity.index),
     `severe from ${number(severe(tortuosity.thresholds))}`, tortuosity.grade],
    ["Sharpest bend", `${along(bend.at_mm)} in${bend.at_ostium_of ? `, the turn into ${bend.at_ostium_of}` : ""}`, degrees(Math.round(bend.angle_deg)),
     `severe below ${degrees(severe(bend.thresholds_deg))}`, bend.grade],
    ["Calcium in and beside it", calcium.volume_mm3 === null ? "not known without a CT" : `above ${number(calcium.above_hu)}\u00a0HU within ${mm(calcium.within_mm)}`,
     calcium.volume_mm3 === null ? "\u2013" : `${number(calcium.volume_mm3)}\u00a0mm\u00b3`, "no grade agreed on",
     calcium.volume_mm3 > 0 ? "look at the slices" : calcium.volume_mm3 === null ? "not known" : "none found"],
  ];
  const note = calcium.volume_mm3 === null ? null : "Calcium: blur hides most of thin plaque, and metal (stents) or bone above the threshold counts too.";
  return block("access", "Access, along the way from the access point to the target",
    sheetTable("Findings of the access", ["What", "Where", "Found", "Held against", "Finding"],
      rows.map((row) => row.map((cell) => el("td", {}, cell)))),
    note ? el("p", {class: "note"}, note) : null);
};

// ---- What to prepare.
const fetchBlock = ({report: {fetch}}) =>
  block("fetch", "To fetch", fetch?.length
    ? el("ul", {}, fetch.map((row) => el("li", {}, `${row.what}${row.assumed ? " (a size is assumed)" : ""}: `, name(shown(row.text)))))
    : el("p", {}, fetch ? "Nothing: there is no plan." : "This report has no list; run the case again for one."));

const lengthBlock = ({anatomy}) => {
  if (!anatomy) return null;
  const {places} = anatomy.lengths;
  const told = (row) => [row.branch ? (row.what.startsWith("the bifurcation") ? "the bifurcation" : `${row.what === "passes" ? "past" : "into"} ${shown(row.branch)}`) : "target", along(row.at_mm)];
  const last = places.slice(-kPlaces);
  return block("lengths", "Lengths from the access",
    el("dl", {class: "pairs"}, last.map(told).flatMap(([place, at]) => [el("dt", {}, place), el("dd", {}, at)])),
    last.length < places.length ? el("p", {class: "note"}, `${places.length - last.length} nearer to the access: in the table below.`) : null);
};

// ---- What is uncertain.
const uncertainBlock = ({report, trials}) => {
  const [first] = report.ranking;
  const items = [];
  if (first) {
    const error = trials[first.trial].errors.tip_error_mm;
    items.push(error === undefined || error === null
      ? "Plan 1: the error of the tip's place is not known."
      : `Plan 1: the tip is where it is told to within ${mm(Number(error.toPrecision(2)))}, by the computation alone.`);
    if (first.sensitive) items.push(`Plan 1 is sensitive: ${shown(first.sensitive_reason)}.`);
    const repeats = report.robustness?.plans?.find((row) => row.trial === first.trial);
    items.push(repeats
      ? `Plan 1: safe in ${safeText(repeats)} repeats with other angles, entry, friction, stiffness of wire and wall, and lumen; the share lies between ${repeats.success_rate_interval.map(wholePercent).join(" and ")}.`
      : "Plan 1 was not repeated with other angles, friction, stiffness and lumen.");
    const shares = report.robustness?.sensitivity?.shares ?? [];
    if (shares.length) {
      items.push(`What decides most between plans: ${shares.slice(0, 2).map((row) => `${kUnknowns[row.unknown] ?? shown(row.unknown)} (${wholePercent(row.share)})`).join(", ")}.`);
    }
    if (first.weakest_confidence) items.push(`Plan 1: the weakest value of its wire is ${shown(first.weakest_confidence)} (${shown(first.weakest_values.slice(0, 3).map(valueName).join(", "))}${first.weakest_values.length > 3 ? ` and ${first.weakest_values.length - 3} more` : ""}).`);
    if (first.tied_with.length) items.push(`${plural(first.tied_with.length, "other plan")} cannot be told apart from plan 1.`);
  }
  items.push("Not in the numbers: errors of the vessel's outline, of the wires' shapes and lengths, blood flow, breathing.");
  const warnings = report.provenance.warnings.map((text) => `Warning: ${shown(text).replace(/^[a-z]+: /, "").replace(/: see wall_motion of each$/, "")}`);
  return block("uncertain", "What is uncertain", cutList([...items, ...warnings], items.length + kWarnings));
};

// ---- The verdict and the picture.
const verdictBlocks = ({verdict}) => {
  if (!verdict) {
    return [el("section", {class: "block verdict unknown", id: "sheet-verdict", "aria-label": "Verdict"}, el("p", {class: "answer-word"}, "No verdict"),
      el("p", {class: "headline"}, "This report has none; run the case again for one.")), []];
  }
  const reasons = cutList(verdict.reasons.map(sentence), kReasons);
  const changes = cutList(verdict.changes.map(sentence), kChanges);
  return [
    el("section", {class: `block verdict ${verdict.answer}`, id: "sheet-verdict", "aria-label": "Verdict"},
      el("p", {class: "answer-word"}, answerName(verdict.answer)),
      el("p", {class: "headline"}, sentence(verdict.headline))),
    [block("why", "Why", reasons),
     block("changes", "What would change it", verdict.changes.length ? changes : el("p", {}, "The trials show nothing that would."))],
  ];
};

const pictureBlock = (page) => {
  const {anatomy, ranking} = page.report;
  const panel = page.panels.anatomy;
  if (!anatomy || !panel) {
    return block("picture", "The vessel", el("p", {}, "A picture of the vessel stands below."));
  }
  const ostium = workingOstium(anatomy.c_arm), known = !anatomy.c_arm.no_views;
  const view = workingView(anatomy.c_arm, ostium, panel);
  const nodes = ranking.length ? page.trials[ranking[0].trial].nodes() : new Float32Array();
  const wire = Array.from({length: nodes.length / 3}, (_, k) => [...nodes.subarray(3 * k, 3 * k + 3)]);
  const drawing = drawView(panel, view, {wire, ostium: ostium?.place_mm, access: page.access, target: page.target});
  const second = ostium?.second && view !== ostium.second ? `Second best: ${ostium.second.view}. ` : "";
  const turn = !ostium ? "Antero-posterior: the way turns into no branch. " : `Shows the turn into ${shown(ostium.branch)} (circled) in its length. `;
  return block("picture", known ? `Working view: ${view.view}` : "The vessel, no C-arm view", drawing,
    el("p", {class: "note"}, `${known ? `${turn}${second}` : `Seen ${view.view}. No C-arm angles: ${shown(anatomy.c_arm.no_views)}. `}` +
      `Way blue, other vessels grey, ${wire.length ? "wire of plan 1 red, " : ""}A access, T target.`));
};

/** Cuts lists, the longest first, then steps of the later plans, until nothing of the sheet is beyond what holds it; puts back of the lists what has room in the end. */
const fit = (sheet) => {
  const lists = [...sheet.querySelectorAll("ul")].filter((list) => list.cut), later = [...sheet.querySelectorAll(".steps")].slice(1);
  const bottom = (node) => node.getBoundingClientRect().bottom;
  const over = () => [...sheet.querySelectorAll(".block, .block > *")].some((node) =>
    bottom(node) > bottom(sheet) + 0.5 || bottom(node) > bottom(node.closest(".columns") ?? sheet) + 0.5);
  const cut = () => {
    lists.sort((a, b) => b.scrollHeight - a.scrollHeight);
    if (lists.some((list) => list.cut())) return true;
    const steps = later.pop();
    steps?.replaceChildren(steps.firstChild, "below.");
    return steps !== undefined;
  };
  sheet.classList.add("on-paper");
  while (over() && cut());
  for (const list of lists) {
    while (list.uncut()) {
      if (!over()) continue;
      list.cut();
      break;
    }
  }
  sheet.classList.remove("on-paper");
};

export const sheetSection = (page) => {
  const {report} = page;
  const [verdict, why] = verdictBlocks(report);
  const {program} = report.provenance;
  const print = (all) => () => {
    document.documentElement.classList.toggle("print-all", all);
    window.print();
  };
  const sheet = el("section", {class: "sheet", id: "sheet", "aria-labelledby": "sheet-title"},
    el("h1", {id: "sheet-title"}, "Guidewire plan: ", name(shown(report.name)), sectionText(report)),
    verdict,
    el("div", {class: "columns wide-left"}, el("div", {class: "stack"}, why), pictureBlock(page)),
    planTable(page),
    accessTable(report),
    el("div", {class: "columns"}, uncertainBlock(page), lengthBlock(report)),
    fetchBlock(page),
    el("p", {class: "statement"}, el("strong", {}, report.statement), ` ${program.name} ${program.version}.`));
  const node = el("div", {class: "sheet-frame"}, sheet,
    el("p", {class: "sheet-buttons buttons"},
      el("button", {type: "button", onclick: print(false)}, "Print this sheet"),
      el("button", {type: "button", onclick: print(true)}, "Print the whole page")));
  return {node, fit: () => fit(sheet)};
};

/** All reasons and changes, of which the sheet may have cut some. */
export const verdictSection = ({report: {verdict}}) => {
  if (!verdict) return null;
  const list = (texts, none) => (texts.length ? el("ul", {}, texts.map((text) => el("li", {}, sentence(text)))) : el("p", {}, none));
  return el("section", {id: "verdict", "aria-labelledby": "verdict-title"},
    el("h2", {id: "verdict-title"}, "The verdict in full"),
    el("p", {class: "answer"}, el("strong", {}, answerName(verdict.answer)), `. ${sentence(verdict.headline)}`),
    el("h3", {}, "Why"), list(verdict.reasons, "Nothing is known."),
    el("h3", {}, "What would change it"), list(verdict.changes, "The trials show nothing that would."));
};
