// What was asked, the answer, what is uncertain, and where it all comes from.
import {place} from "./anatomy.js";
import {el, facts, name, section, table} from "./dom.js";
import {degrees, number, outcomeWord, percent, planName, plural, shown, wallOfScouts, withError} from "./format.js";

const list = (values, text) => values.map(text).join(", ");
const point = (p) => `(${p.map((x) => number(x)).join(", ")})\u00a0mm`;

/** Those that pairs were made of, each once. */
const catheterNames = ({pairs}) => [...new Set(pairs.map((pair) => shown(pair.catheter)))].join(", ") || "none that the ostium asks for";

/** The wires' own coefficients, else the case's, as they act. */
const frictionText = ({wires, friction, friction_factor: factor}) => {
  const of = (wire) => number((wire.friction?.value ?? wire.friction ?? friction) * (factor ?? 1));
  return new Set(wires.map(of)).size > 1
    ? `coefficients: ${list(wires, (wire) => `${shown(wire.name)} ${of(wire)}`)}`
    : `coefficient ${of(wires[0])}`;
};

/** How the wall gives way, and the vessel with it. */
const wallText = ({wall_model: model, wall_stiffness_kpa_per_mm: stiffness}, support) =>
  (model === "rigid" ? "rigid" : `yields, ${number(stiffness)}\u00a0kPa/mm`) +
  (support === undefined ? "" : `; the vessel moves as a whole on a support of ${number(support)}\u00a0kPa/mm`);

/** So many of each plan, or up to so many where some have fewer. */
const repeatsText = ({repeats, plans}, text) =>
  `${plans?.some((plan) => plan.repeats < repeats) ? "up to " : ""}${text(repeats)}`;

export const askedSection = (page) => {
  const {report, trials} = page;
  const asked = report.provenance.parameters;
  const [input] = report.provenance.inputs;
  return section("asked", "What was asked",
    el("p", {}, report.catheters
      ? "With which of these wires and catheters, and by which moves of both, is the target reached with the least force on the wall?"
      : "Which of these wires, pushed in at which of these angles, reaches the target with the least force on the wall?"),
    facts([
      ["Case", name(shown(report.name))],
      ["Input", name(shown(input.name))],
      ["Access", point(page.access)],
      ["Target", page.atSection ? `${point(page.target)}, reached where the tip passes the vessel's cross-section there` : `${point(page.target)}, reached within ${number(page.targetRadius)}\u00a0mm`],
      ["Way", `${withError(report.vessel.branches[0].length_mm, null).split("\u00a0")[0]}\u00a0mm along the middle of the lumen, ${number(report.vessel.branches[0].min_diameter_mm)} to ${number(report.vessel.branches[0].max_diameter_mm)}\u00a0mm wide`],
      ["Wires", list(asked.wires, (w) => shown(w.name))],
      ...(report.catheters ? [["Catheters", name(catheterNames(report.catheters))]] : []),
      ["Entry", `inclination ${list(asked.access.inclination_deg, degrees)}; azimuth ${list(asked.access.azimuth_deg, degrees)}`],
      ["Roll of the tip", list(asked.tip_roll_deg, degrees)],
      ["Friction", frictionText(asked)],
      ["Wall", wallText(report.vessel, asked.wall.support_kpa_per_mm)],
      ["Tried", plural(trials.length, "insertion")],
      ["Repeats", report.robustness?.repeats > 0
        ? `${repeatsText(report.robustness, String)} of each of the best plans, disturbed in angle, friction, stiffness, wall and lumen`
        : "none asked: how robust a plan is, is not known"],
    ]));
};

export const answerSection = (page) => {
  const {report, trials} = page;
  const [best] = report.ranking;
  if (!best) {
    const counts = new Map();
    for (const t of trials) counts.set(t.outcome, (counts.get(t.outcome) ?? 0) + 1);
    const scouted = trials.filter((t) => t.level !== "full").length;
    return section("answer", "The answer",
      el("p", {class: "answer"}, `No plan reaches the target within the limits: of ${plural(trials.length, "trial")} `,
        [...counts].map(([outcome, count]) => `${count} ${outcomeWord(outcome)}`).join(", "),
        scouted ? `. ${scouted} of them were run against ${wallOfScouts(report)} only; --exhaustive runs all in full.` : "."));
  }
  const t = trials[best.trial], errors = t.errors;
  const ties = best.tied_with.length;
  const repeats = report.robustness?.plans?.find((row) => row.trial === best.trial);
  const rate = best.success_rate === null || best.success_rate === undefined
    ? "How often it is safe when angles, friction and wall differ was not asked."
    : `With angles, friction and wall disturbed it is safe (reaches, and breaks no limit) in ${repeats ? `${repeats.successes} of ${plural(repeats.repeats, "repeat")}` : `${percent(best.success_rate)} of repeats`} (${percent(best.success_rate_interval[0])} to ${percent(best.success_rate_interval[1])}).`;
  return section("answer", "The answer",
    el("p", {class: "answer"},
      "Best of ", plural(report.ranking.length, "safe plan"), `, which reach and break no limit; ${trials.filter((x) => x.reached).length} of ${trials.length} tried reach: `,
      el("strong", {}, el("bdi", {}, planName(t))),
      (page.atSection ? ". Its tip passes the vessel's cross-section at the target, with at most " : `. Its tip ends ${withError(t.tip_to_target_mm, errors.position_error_mm)}\u00a0mm from the target's middle, with at most `) +
      `${withError(t.peak_contact_force_n, errors.peak_contact_force_error_n)}\u00a0N on any 5\u00a0mm of wire and ${withError(t.peak_tip_force_n, errors.peak_tip_force_error_n)}\u00a0N at the tip.`),
    el("p", {}, ties ? `${plural(ties, "other plan")} cannot be told apart from it: ${best.tied_with.map((id) => `plan ${trials[id].plan?.rank ?? "?"}`).join(", ")}. ` : "No other plan is as good within the errors. ", rate),
    el("p", {class: "note"}, "\u00b1 is the estimated numerical error alone, which holds the true value in 95\u00a0% of cases; see what is uncertain below."));
};

const rangeOf = (values) => [...new Set([Math.min(...values), Math.max(...values)].map(number))].join(" to ");

/** What turning one angle of the best plan does, told by the trials that differ in it alone. */
const sensitivity = (page, best, key, title) => {
  const keys = ["wire", "inclination_deg", "azimuth_deg", "roll_deg"].filter((k) => k !== key);
  const others = page.trials.filter((t) => t.id !== best.id && t[key] !== best[key] && keys.every((k) => t[k] === best[k]));
  if (!others.length) return [title, "only one value was tried", "not known"];
  const reached = others.filter((t) => t.reached);
  return [title, `${plural(others.length, "other value")} tried`,
    `${reached.length} of them reach` + (reached.length ? `, with a largest contact of ${rangeOf(reached.map((t) => t.peak_contact_force_n))}\u00a0N against ${number(best.peak_contact_force_n)}\u00a0N` : "")];
};

/** How far each unknown may be off, and its share in what moves the plans against each other. */
const unknownRows = ({robustness, vessel, catheters}) => {
  const {unknowns, sensitivity} = robustness;
  const wires = catheters ? "wires and catheters" : "wires";
  const names = {
    friction: ["Friction", `times ${(unknowns.friction_factor ?? []).map(number).join(" to ")}, each wire by its own spread`],
    ...(unknowns.stiffness_factor ? {stiffness: [`Stiffness of the ${wires}`, `times ${unknowns.stiffness_factor.map(number).join(" to ")}, each by its own spread`]} : {}),
    ...(vessel.wall_model === "rigid" ? {} : {wall: ["Stiffness of the wall", `times ${(unknowns.wall_factor ?? []).map(number).join(" to ")}`]}),
    angle: ["Angle of the introducer", `\u00b1\u00a0${degrees(unknowns.angle_deg)}`],
    entry: ["Place of entry", `\u00b1\u00a0${number(unknowns.entry_mm)}\u00a0mm`],
    lumen: ["Width of the lumen", `wall moved by \u00b1\u00a0${number(unknowns.lumen_mm)}\u00a0mm`],
    ...(unknowns.support_factor ? {support: ["Support of the vessel", `times ${unknowns.support_factor.map(number).join(" to ")}`]} : {}),
  };
  const shares = new Map((sensitivity?.shares ?? []).map(({unknown, share}) => [unknown, share]));
  return Object.entries(names).map(([key, [title, range]]) =>
    [title, `${range}, in ${repeatsText(robustness, (count) => plural(count, "repeat"))} of each of the best plans`,
     shares.has(key) ? `${percent(shares.get(key))} of what moves these plans against each other` : "no share found"]);
};

/** What the repeats made of the best plan. */
const spreadRow = (robustness, trial, first) => {
  const row = robustness.plans.find((plan) => plan.trial === trial);
  if (!row) return null;
  const {low, median, high} = row.peak_contact_force_n;
  return ["All of these together, best plan",
    `safe in ${row.successes} of ${row.repeats}, reaches in ${row.reached ?? row.successes}: ${percent(first.success_rate)}, interval ${first.success_rate_interval.map(percent).join(" to ")}`,
    `largest contact ${number(median)}\u00a0N in the middle, ${number(low)} to ${number(high)}\u00a0N in 90\u00a0% of repeats` +
      (row.failures.length ? `; fails because: ${[...new Set(row.failures.map((f) => shown(f.reason)))].slice(0, 3).join("; ")}` : "")];
};

const scoutRow = (scout, report) => ["Coarse trials that sorted out the rest",
  `${plural(scout.trials, "trial")} with elements of ${number(scout.element_length_mm)}\u00a0mm in ${wallOfScouts(report)}; of them ${scout.probed} run there with fine elements, ${scout.compared} in full`,
  `of those that were run again: ${plural(scout.missed, "plan")} that the coarse trial took for failing reach, and ${scout.false_reached} that it took for reaching fail`];

export const uncertainSection = (page) => {
  const {report, trials} = page;
  const [first] = report.ranking;
  const rows = [];
  if (first) {
    const best = trials[first.trial], e = best.errors;
    rows.push(["Length of the wire's elements", e.position_error_mm === undefined || e.position_error_mm === null ? `error not estimated${e.null_reasons?.position_error_mm ? `: ${shown(e.null_reasons.position_error_mm)}` : ""}` : `best plan run with elements twice and half as long`,
      e.position_error_mm === undefined || e.position_error_mm === null ? "not known" :
      `position \u00b1\u00a0${number(e.position_error_mm)}\u00a0mm, largest contact \u00b1\u00a0${number(e.peak_contact_force_error_n)}\u00a0N; score \u00b1\u00a0${number(first.score_error)}, which ties ${plural(first.tied_with.length, "plan")} with the best`]);
    if (first.sensitive !== undefined) {
      const others = e.settings ?? [], come = others.filter((row) => row.incomplete === "");
      const ends = come.length < others.length ? "it does not come as far" : `its tip ends at most ${number(Math.max(...come.map((row) => row.tip_apart_mm)))}\u00a0mm away`;
      rows.push(["Length of a push in the computation",
        first.sensitive === null ? "not known" : `best plan run with pushes half as long: ${ends}`,
        first.sensitive ? `sensitive: ${shown(first.sensitive_reason)}` : first.sensitive === null ? "not known" : "within the errors above"]);
    }
    rows.push(sensitivity(page, best, "inclination_deg", "Inclination of the introducer"));
    rows.push(sensitivity(page, best, "azimuth_deg", "Azimuth of the introducer"));
    rows.push(sensitivity(page, best, "roll_deg", "Roll of the tip"));
    const {robustness} = report;
    if (robustness?.repeats > 0) {
      rows.push(...unknownRows(report), spreadRow(robustness, best.id, first));
    } else {
      rows.push(["Friction, stiffness of wires and wall, and small errors of the angles", "not varied: the case asked for no repeats", "not known"]);
    }
  }
  rows.push(["Shape of the lumen in the simulation", `smooth field on a grid of ${number(report.numerics.lumen_grid_mm)}\u00a0mm`,
    `off the surface by ${number(report.numerics.lumen_mean_deviation_mm)}\u00a0mm on average, ${number(report.numerics.lumen_max_deviation_mm)}\u00a0mm at most`]);
  if (report.numerics.scout) rows.push(scoutRow(report.numerics.scout, report));
  const beyond = trials.filter((t) => t.beyond_linear_theory === true).length;
  if (report.vessel.wall_model !== "rigid") {
    const bestBeyond = first && trials[first.trial].beyond_linear_theory;
    rows.push(["Wall by linear theory", `${beyond} of ${plural(trials.length, "trial")} moved it further than the theory holds`,
      first ? `the best plan ${bestBeyond ? "did: its forces are rough" : "did not"}` : "forces of those are rough"]);
  }
  rows.push(["Segmentation, shapes and lengths of the wires, blood flow, breathing", "not varied", "not known; see the limits"]);
  return section("uncertain", "What is uncertain, and how much it matters",
    table("Uncertainties", ["What", "How it was looked at", "What it changes"], rows.filter(Boolean)));
};

/** How bringing a pair's wire in by exchange ended. */
const exchanged = (row) => {
  if (!row) return "\u2013";
  if (!row.tried) return `not tried: ${shown(row.reason)}`;
  return `${plural(row.scripts_found, "script")} after ${shown(row.first_wire)}${row.reason ? `; ${shown(row.reason)}` : ""}`;
};

/** Every catheter with every wire: what came of it, or why it was not tried. */
export const catheterSection = ({report: {catheters}}) => {
  if (!catheters?.pairs.length) return null;
  const rows = catheters.pairs.map((pair) => [name(`${shown(pair.wire)} in ${shown(pair.catheter)}`),
    pair.tried ? plural(pair.scripts_found, "script") : "not tried",
    exchanged(pair.exchange),
    pair.nearest_hook_mm === undefined ? "\u2013" : number(pair.nearest_hook_mm),
    pair.reason ? shown(pair.reason) : "\u2013"]);
  return section("catheters", "Catheters and wires",
    catheters.suggested ? el("ul", {}, catheters.suggested.map((row) => el("li", {}, el("strong", {}, shown(row.catheter)), `: ${shown(row.reason)}.`))) : null,
    table("Pairs of catheter and wire", ["Pair", "Found in the search", "In exchange for another wire", "Catheter's tip to the ostium at best [mm]", "What stopped it"], rows));
};

/** Of a vessel that moves as a whole: what the best trial of each wire moves, and by how much that differs over its repeats. */
export const motionSection = ({report: {vessel_motion: motion}}) => {
  if (!motion?.trials.length) return null;
  // To a tenth of a millimetre or degree: no less is known of a support that was not measured.
  const tenths = (value, unit) => (value < 0.05 ? `under 0.1${unit}` : `${value.toFixed(1)}${unit}`);
  const inMm = (value) => tenths(value, "\u00a0mm"), inDegrees = (value) => tenths(value, "\u00b0");
  const spread = (row, unit) => (row ? `${row.low.toFixed(1)} to ${row.high.toFixed(1)}${unit}` : "\u2013");
  const side = (value, plus, minus) => `${value < 0 ? minus : plus} ${Math.abs(Math.round(value))}`;
  const view = (v) => (v ? `${side(v.rotation_deg, "LAO", "RAO")}, ${side(v.tilt_deg, "CRA", "CAU")}` : "\u2013");
  const rowsOf = (trial) => {
    const over = trial.under_disturbances;
    const overTurn = ({branch}) => over?.turns.find((row) => row.branch === branch);
    return [
      [`Largest shift, at ${place(trial.most_at_mm)}`, "\u2013", inMm(trial.most_mm), spread(over?.most_mm, "\u00a0mm")],
      ["Length of the way", inMm(trial.way_length_mm), inMm(trial.moved_way_length_mm), spread(over?.moved_way_length_mm, "\u00a0mm")],
      ...trial.ostia.map((row, k) => [name(`Shift of the ostium of ${shown(row.branch)}`), "\u2013", inMm(row.shift_mm), spread(over?.ostia[k]?.shift_mm, "\u00a0mm")]),
      ...trial.turns.flatMap((row) => [
        [name(`Turn into ${shown(row.branch)}`), inDegrees(row.at_rest_deg), inDegrees(row.moved_deg), spread(overTurn(row)?.moved_deg, "\u00b0")],
        [name(`From the access to ${shown(row.branch)}`), inMm(row.from_access_mm), inMm(row.moved_from_access_mm), spread(overTurn(row)?.moved_from_access_mm, "\u00a0mm")],
        [name(`C-arm there: the line of sight changes by ${inDegrees(row.view_change_deg)}`), view(row.view_at_rest), view(row.view_moved), spread(overTurn(row)?.view_change_deg, "\u00b0 of change")],
      ]),
    ];
  };
  return section("motion", "How the wire moves the vessel",
    el("p", {class: "note"}, `By the best plan of each wire, or its closest attempt, where it ends, on a support of ${number(motion.support_kpa_per_mm)}\u00a0kPa/mm (${shown(motion.support_source)}). Places are those of the vessel at rest.`),
    ...motion.trials.flatMap((trial) => [
      el("h3", {}, name(`${shown(trial.wire)}: ${outcomeWord(trial.outcome)}`)),
      table(`What ${shown(trial.wire)} moves`, ["What", "At rest", "Moved", trial.under_disturbances ? `90\u00a0% of ${plural(trial.under_disturbances.repeats, "repeat")} that reached` : "Not repeated"], rowsOf(trial)),
    ]));
};

export const warningSection = (page) => {
  const {warnings} = page.report.provenance;
  return section("warnings", "Warnings and limits",
    el("h3", {}, "Warnings of this run"),
    warnings.length ? el("ul", {}, warnings.map((w) => el("li", {}, shown(w)))) : el("p", {}, "None."),
    el("h3", {}, "Limits of validity"),
    el("ul", {}, page.report.limits.map((limit) => el("li", {}, shown(limit)))));
};

export const provenanceSection = (page) => {
  const {report, timing} = page;
  const {program, inputs, parameters, stages, terms} = report.provenance;
  const seconds = (timing.stages ?? []).map((s) => [s.stage, `${number(s.seconds)}\u00a0s`]);
  return section("provenance", "Where it comes from",
    facts([
      ["Program", `${program.name} ${program.version} (${program.revision}), ${program.compiler}, ${program.build_type}`],
      ["Libraries", Object.entries(program.libraries).map(([k, v]) => `${k} ${v}`).join(", ")],
      ...inputs.map((input) => ["Input", el("span", {}, name(shown(input.name)), ", SHA-256 ", el("code", {}, input.sha256))]),
      ["Parameters", el("span", {}, "SHA-256 ", el("code", {}, report.provenance.parameters_sha256))],
      ["Seed", report.provenance.seed === null ? report.provenance.null_reasons?.seed ?? "none" : String(report.provenance.seed)],
      ["Stages", stages.join(", ")],
      ["Energy terms", terms.join(", ")],
    ]),
    el("details", {}, el("summary", {}, "All parameters"),
      el("pre", {tabindex: "0"}, shown("").concat(JSON.stringify(parameters, null, 1).split("\n").map(shown).join("\n")))),
    el("details", {}, el("summary", {}, "Files beside this page"),
      table("Files", ["File", "Content"], report.artifacts.map((a) => [a.file, a.content]))),
    el("details", {}, el("summary", {}, `Run times (${plural(timing.threads ?? 0, "thread")})`),
      table("Run times", ["Stage", "Time"], seconds)));
};
