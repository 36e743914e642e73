// The page of a case of several accesses or targets: for each target its accesses side by side, best
// first, with links to their own reports.
import {el, name} from "./dom.js";
import {degrees, number, shown, toolsName} from "./format.js";
import {answerName, sentence} from "./sheet.js";

const mm = (value) => `${number(value)}\u00a0mm`;
const two = (value) => number(Number(value.toPrecision(2)));
const link = (row, text) => el("a", {href: `${row.folder.split("/").map(encodeURIComponent).join("/")}/report.html`}, text);

const heads = ["Access", "Answer", "Best plan", "Safe repeats", "Largest force on wall", "Way", "Narrowest lumen", "Sheath", "Tortuosity", "Sharpest bend", "Calcium"];

const planText = (plan) => {
  if (!plan) return "no safe plan";
  const angles = `tilt ${degrees(plan.inclination_deg)} toward ${degrees(plan.azimuth_deg)}, roll ${degrees(plan.roll_deg)}`;
  return el("span", {}, name(toolsName(plan)), `, ${angles}`, plan.script ? `; ${sentence(plan.script)}` : "");
};

const graded = (value, grade) => (value === null ? "not known" : `${value} (${grade})`);

const cells = (row) => {
  const {best_plan: plan, access_table: table} = row;
  return [
    link(row, row.access === null ? "report" : shown(row.access)),
    row.verdict ? answerName(row.verdict.answer) : "\u2013",
    row.other_access ? el("span", {}, planText(plan), ". ", shown(row.other_access)) : planText(plan),
    plan && plan.repeats !== null ? `${plan.repeats_safe} of ${plan.repeats}` : "\u2013",
    plan && plan.peak_contact_force_n !== null ? `${two(plan.peak_contact_force_n)}\u00a0N` : "\u2013",
    mm(Math.round(table.way_mm)),
    `${mm(table.least_diameter_mm)}${table.device_fits ? "" : ": the device does not fit"}`,
    table.sheath_fits === null ? "not weighed" : `${table.sheath_fits ? "fits" : "does not fit"} in ${mm(table.least_diameter_at_sheath_mm)}`,
    graded(table.tortuosity === null ? null : table.tortuosity.toFixed(2), table.tortuosity_grade),
    table.sharpest_bend_at_ostium_of === null
      ? graded(degrees(Math.round(table.sharpest_bend_deg)), table.sharpest_bend_grade)
      : `${degrees(Math.round(table.sharpest_bend_deg))}, the turn into ${shown(table.sharpest_bend_at_ostium_of)}`,
    table.calcium_mm3 === null ? "not known" : `${number(table.calcium_mm3)}\u00a0mm\u00b3`,
  ];
};

const targetSection = (target, k) => {
  const title = target.target === null ? "Target" : shown(target.target);
  const first = target.sections[0];
  return el("section", {id: `target-${k + 1}`, "aria-label": title},
    el("h2", {}, title),
    el("p", {class: "answer"}, first.verdict ? `${first.access === null ? "" : `${shown(first.access)}: `}${shown(first.verdict.headline)}` : shown(target.sentence)),
    el("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": `Accesses to ${title}`},
      el("table", {},
        el("thead", {}, el("tr", {}, heads.map((head) => el("th", {scope: "col"}, head)))),
        el("tbody", {}, target.sections.map((row) => el("tr", {}, cells(row).map((cell) => el("td", {}, cell))))))));
};

export const showOverview = (overview) => {
  document.title = `${shown(overview.name)}: wireplan overview`;
  document.documentElement.classList.add("print-all", "overview");
  document.getElementById("page").append(
    el("header", {},
      el("h1", {}, "Guidewire plans: ", el("bdi", {}, shown(overview.name))),
      el("p", {class: "notice"}, el("strong", {}, overview.statement))),
    el("p", {}, "For each target its accesses, the best first: by the answer, then by how many of the best plan's disturbed repeats reach the target with no limit broken, then by its forces. Each name leads to the report of that way."),
    ...overview.targets.map(targetSection));
};
