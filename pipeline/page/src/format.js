// Numbers and names as the page shows them.

const kControl = /[\u0000-\u001f\u007f-\u009f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff]/g;

/** A name from a file, with characters that hide or turn text round made visible. */
export const shown = (text) =>
  String(text).replace(
    kControl,
    (c) => `\u27e8U+${c.charCodeAt(0).toString(16).toUpperCase().padStart(4, "0")}\u27e9`,
  );

/** Three significant digits, without an exponent where a reader can do without. */
export const number = (value) => {
  if (value === null || value === undefined || !Number.isFinite(value)) return "\u2013";
  const size = Math.abs(value);
  if (size < 1e-9) return "0";  // what rounding leaves of a force where nothing touches
  if (size >= 1e5 || size < 1e-4) return value.toExponential(1);
  if (size >= 100) return value.toFixed(0);
  return String(Number(value.toPrecision(3)));
};

/** "0.046 \u00b1 0.002", to the error's digits; "0.046 \u00b1 ?" where the error was not estimated. */
export const withError = (value, error) => {
  if (value === null || value === undefined) return "\u2013";
  if (error === null || error === undefined) return `${number(value)}\u00a0\u00b1\u00a0?`;
  if (error === 0) return `${number(value)}\u00a0\u00b1\u00a00`;
  const digits = Math.min(6, Math.max(0, -Math.floor(Math.log10(error)) + (error < 1 ? 0 : 1)));
  if (error < 1e-6) return `${number(value)}\u00a0\u00b1\u00a0${number(error)}`;
  return `${value.toFixed(digits)}\u00a0\u00b1\u00a0${Number(error.toFixed(digits)) || number(error)}`;
};

export const degrees = (value) => `${number(value)}\u00b0`;

export const percent = (value) => `${number(100 * value)}\u00a0%`;

export const plural = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;

const kOutcomes = {
  reached: {word: "reached the target", mark: "\u2713"},
  missed: {word: "missed the target", mark: "M"},
  passed_by: {word: "passed by the branch", mark: "B"},
  wrong_branch: {word: "took the wrong branch", mark: "W"},
  left_image: {word: "came to the end of the imaged vessel", mark: "E"},
  stuck: {word: "got stuck", mark: "S"},
  prolapsed: {word: "folded back on itself", mark: "P"},
  another_way: {word: "came to the target another way", mark: "A"},
  crosses_itself: {word: "crossed itself in a loop", mark: "X"},
  left_lumen: {word: "left the lumen", mark: "L"},
  not_converged: {word: "no equilibrium found", mark: "N"},
  failed: {word: "failed in the program", mark: "F"},
};
export const outcomeWord = (outcome) => kOutcomes[outcome]?.word ?? shown(outcome);
export const outcomeMark = (outcome) => kOutcomes[outcome]?.mark ?? "?";
export const outcomes = Object.keys(kOutcomes);

/** What scouts and probes meet. */
export const wallOfScouts = (report) => (report.vessel_motion ? "a wall that moves as a whole but takes no dents" : "a rigid wall");

/** "bentson", "bentson in cobra-c2", or "amplatz-stiff in cobra-c2 in exchange for bentson". */
export const toolsName = (trial) => `${shown(trial.wire)}${trial.catheter ? ` in ${shown(trial.catheter)}` : ""}${trial.first_wire ? ` in exchange for ${shown(trial.first_wire)}` : ""}`;

/** "amplatz-stiff, inclination 10\u00b0, azimuth 90\u00b0, roll 0\u00b0", and the moves where it is no straight push. */
export const planName = (trial) =>
  `${toolsName(trial)}, inclination ${degrees(trial.inclination_deg)}, azimuth ` +
  `${degrees(trial.azimuth_deg)}, roll ${degrees(trial.roll_deg)}` +
  (trial.script ? `; ${shown(trial.script)}` : "");

const kValues = {
  diameter_mm: "diameter", coating: "coating", friction: "friction", length_mm: "length", taper: "taper", rest_radius_mm: "curve",
  bending_stiffness_n_mm2: "EI", flexural_modulus_gpa: "EI", tip_load_gf: "EI", axial_stiffness_n: "EA", twist_stiffness_n_mm2: "GJ",
};
/** "EI of section 2, from the tip" of "sections[1].bending_stiffness_n_mm2". */
export const valueName = (key) => {
  const [, section, own] = key.match(/^sections\[(\d+)\]\.(.*)$/) ?? [null, null, key];
  return `${kValues[own] ?? own}${section === null ? "" : ` of section ${Number(section) + 1}`}`;
};
