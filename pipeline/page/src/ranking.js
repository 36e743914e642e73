// The ranked plans, and on request every trial, as a table to sort and filter.
import {el, section} from "./dom.js";
import {degrees, number, outcomeWord, percent, plural, shown, toolsName, wallOfScouts, withError} from "./format.js";

const success = ({plan}) => {
  if (!plan || plan.success_rate === null || plan.success_rate === undefined) return "not repeated";
  const [low, high] = plan.success_rate_interval;
  return `${percent(plan.success_rate)} (${percent(low)} to ${percent(high)})`;
};

/** A number of a trial with its error; of a coarse one it is rough. */
const told = (trial, value, error) =>
  trial.level !== "full" && value !== null ? `\u2248\u00a0${number(value)}` : withError(value, error);

// Title, what to sort by, what to show.
const kColumns = [
  ["Rank", (t) => t.plan?.rank ?? Infinity, (t) => t.plan?.rank ?? "\u2013"],
  ["Wire", toolsName, (t) => el("bdi", {}, toolsName(t))],
  ["Inclination", (t) => t.inclination_deg, (t) => degrees(t.inclination_deg)],
  ["Azimuth", (t) => t.azimuth_deg, (t) => degrees(t.azimuth_deg)],
  ["Roll", (t) => t.roll_deg, (t) => degrees(t.roll_deg)],
  ["Moves", (t) => t.script ?? "", (t) => (t.script ? shown(t.script) : "one push")],
  ["Tip to target [mm]", (t) => t.tip_to_target_mm, (t) => told(t, t.tip_to_target_mm, t.errors.position_error_mm)],
  ["Largest contact [N]", (t) => t.peak_contact_force_n, (t) => told(t, t.peak_contact_force_n, t.errors.peak_contact_force_error_n)],
  ["Mean contact [N]", (t) => t.mean_contact_force_n, (t) => told(t, t.mean_contact_force_n, t.errors.mean_contact_force_error_n)],
  ["Tip force [N]", (t) => t.peak_tip_force_n, (t) => told(t, t.peak_tip_force_n, t.errors.peak_tip_force_error_n)],
  ["Score, 0 best", (t) => t.plan?.score ?? Infinity, (t) => (t.plan ? withError(t.plan.score, t.plan.score_error) : "\u2013")],
  ["Safe share", (t) => t.plan?.success_rate ?? -1, success],
  ["Weakest value of the wire", (t) => t.plan?.weakest_confidence ?? "", (t) => (t.plan?.weakest_confidence ? shown(t.plan.weakest_confidence) : "\u2013")],
  ["Why", (t) => t.plan?.sentence ?? t.excluded ?? "", (t) => shown(t.plan ? t.plan.sentence : t.excluded ?? outcomeWord(t.outcome))],
];

// Of scripts of catheter and wire.
const kSupport = ["Seated catheter bears [N]", (t) => t.tools?.support_n ?? -1,
  (t) => (t.tools ? `${t.tools.support_is_least ? "\u2265\u00a0" : ""}${told(t, t.tools.support_n, t.errors.support_error_n)}` : "\u2013")];
const columnsOf = (trials) => trials.some((t) => t.tools) ? [...kColumns.slice(0, 10), kSupport, ...kColumns.slice(10)] : kColumns;

const weightsOf = (report) =>
  Object.values(report.provenance.parameters.ranking).flatMap((weights) => Object.entries(weights)).map(([name, weight]) => `${name.replaceAll("_", " ")} ${weight}`).join(", ");

const compare = (a, b) => {
  if (typeof a === "string") return a.localeCompare(b);
  return (a ?? Infinity) - (b ?? Infinity) || 0;
};

export const rankingSection = (page, selection) => {
  const {trials} = page, columns = columnsOf(trials);
  let column = 0, falling = false;

  const tools = [...new Set(trials.map(toolsName))];
  const wire = el("select", {id: "filter-wire", onchange: () => fill()},
    el("option", {value: ""}, "all wires"),
    tools.map((name, k) => el("option", {value: k}, name)));
  const which = el("select", {id: "filter-rank", onchange: () => fill()},
    el("option", {value: "ranked"}, "ranked plans"),
    el("option", {value: "all"}, "all trials"));
  const count = el("p", {role: "status", id: "ranking-count"});
  const body = el("tbody", {});

  const heads = columns.map(([title], k) =>
    el("th", {scope: "col"},
      el("button", {type: "button", class: "sort", onclick: () => {
        falling = column === k ? !falling : false;
        column = k;
        fill();
      }}, title)));

  const fill = () => {
    const shownTrials = trials.filter(
      (t) => (wire.value === "" || toolsName(t) === tools[Number(wire.value)]) && (which.value === "all" || t.plan));
    const [, key] = columns[column];
    // Ties keep the order of ranks, then of trials.
    shownTrials.sort((a, b) =>
      (falling ? -1 : 1) * compare(key(a), key(b)) ||
      (a.plan?.rank ?? Infinity) - (b.plan?.rank ?? Infinity) || a.id - b.id);
    heads.forEach((head, k) => head.setAttribute("aria-sort", k !== column ? "none" : falling ? "descending" : "ascending"));
    body.replaceChildren(...shownTrials.map((t) => {
      const pick = el("button", {type: "button", class: "pick", "data-trial": t.id, onclick: () => selection.set(t.id),
        "aria-label": `Show ${t.plan ? `plan ${t.plan.rank}` : `trial ${t.id}`} in the vessel`}, "Show");
      return el("tr", {"data-trial": t.id}, el("td", {}, pick), columns.map(([, , text]) => el("td", {}, text(t))));
    }));
    count.textContent = `${plural(shownTrials.length, which.value === "all" ? "trial" : "plan")} shown of ${plural(trials.length, "trial")}.`;
    mark(selection.get());
  };
  const mark = (id) => {
    for (const row of body.children) {
      const chosen = Number(row.dataset.trial) === id;
      row.classList.toggle("chosen", chosen);
      row.querySelector("button").setAttribute("aria-pressed", String(chosen));
    }
  };
  if (!page.report.ranking.length) which.value = "all";
  fill();
  selection.follow(mark);

  return section("ranking", "Plans, best first",
    el("div", {class: "controls"},
      el("label", {for: "filter-wire"}, "Wire "), wire,
      el("label", {for: "filter-rank"}, "Show "), which),
    count,
    el("div", {class: "scroll tall", tabindex: "0", role: "region", "aria-label": "Table of plans"},
      el("table", {id: "plans"},
        el("thead", {}, el("tr", {}, el("td", {}), heads)),
        body)),
    el("p", {class: "note"},
      "\u00b1 is the estimated error of the simulation's finite elements and of the path that its solver takes; \u00b1\u00a0? where it was not estimated, as only the best plans are run again with finer elements. " +
      (trials.some((t) => t.level !== "full") ? `\u2248 marks trials against ${wallOfScouts(page.report)}, most of them with long elements. ` : "") +
      `The score is the mean of its components by these weights: ${weightsOf(page.report)}. ` +
      "Errors of the wire's, the wall's and the image's data are not in it. Plans that the errors cannot tell apart are ties; those whose end hangs on how they are solved are sensitive, and stand last, as do those whose tip's error may put it outside the target, or could not be told."));
};
