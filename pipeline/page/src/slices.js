// Slices of the volume with the outline of the lumen: does the vessel lie where the image shows it?
import {floats} from "./data.js";
import {el, section, svg} from "./dom.js";
import {number} from "./format.js";

// Names at left, right, top and bottom: the patient's sides, or the input's axes where those are not known.
const kSides = {axial: [..."RLAP"], coronal: [..."RLSI"], sagittal: [..."APSI"]};
const kAxes = {axial: ["\u2212x", "+x", "\u2212y", "+y"], coronal: ["\u2212x", "+x", "+z", "\u2212z"], sagittal: ["\u2212y", "+y", "+z", "\u2212z"]};

const drawCut = (slices, cut, place, known) => {
  const size = slices.size_px * slices.spacing_mm, half = size / 2;
  const lines = floats(cut.outline_mm);
  let path = "";
  for (let k = 0; k < lines.length; k += 4) {
    path += `M${lines[k].toFixed(2)} ${lines[k + 1].toFixed(2)}L${lines[k + 2].toFixed(2)} ${lines[k + 3].toFixed(2)}`;
  }
  const [left, right, top, bottom] = (known ? kSides : kAxes)[cut.plane];
  const plane = known ? cut.plane : `across ${{axial: "z", coronal: "y", sagittal: "x"}[cut.plane]}`;
  const letter = (x, y, text) => svg("text", {x, y, class: "side"}, text);
  return el("figure", {class: "slice"},
    svg("svg", {viewBox: `${-half} ${-half} ${size} ${size}`, role: "img",
                "aria-label": `${plane} slice at the place: ${place.name}, with the outline of the lumen`},
      svg("image", {href: `data:image/jpeg;base64,${cut.jpeg}`, x: -half, y: -half, width: size, height: size}),
      svg("path", {d: path, class: "outline-under"}),
      svg("path", {d: path, class: "outline"}),
      svg("path", {d: "M-4 0H-1.5M1.5 0H4M0 -4V-1.5M0 1.5V4", class: "cross"}),
      svg("path", {d: `M${half - 14} ${half - 4}h10`, class: "bar"}),
      svg("text", {x: half - 9, y: half - 6, class: "side"}, "10 mm"),
      letter(-half + 4, 0, left), letter(half - 4, 0, right), letter(0, -half + 6, top), letter(0, half - 3, bottom)),
    el("figcaption", {}, plane));
};

export const sliceSection = (page) => {
  const {slices} = page.panels;
  const known = page.report.provenance.parameters.axes !== "unknown";
  if (!slices) {
    return section("slices", "Does the vessel fit the image?",
      el("p", {class: "missing"}, "This case starts from a surface: there is no volume to check it against."));
  }
  const {places} = slices;
  const names = places.map((place) => place.name);
  const frame = el("div", {class: "slices"});
  const slider = el("input", {type: "range", id: "place", min: "0", max: String(places.length - 1), step: "1"});
  const state = el("output", {for: "place", id: "place-state"});
  const jumps = el("div", {class: "buttons", role: "group", "aria-label": "Places"});
  const show = (k) => {
    const place = places[k];
    slider.value = String(k);
    slider.setAttribute("aria-valuetext", place.name);
    state.textContent = `${place.name}, at (${place.point_mm.map((x) => number(Number(x.toFixed(1)))).join(", ")})\u00a0mm`;
    frame.replaceChildren(...place.cuts.map((cut) => drawCut(slices, cut, place, known)));
  };
  slider.addEventListener("input", () => show(Number(slider.value)));
  for (const name of ["access", "largest force on the wall", "target"]) {
    const k = names.indexOf(name);
    if (k >= 0) jumps.append(el("button", {type: "button", onclick: () => show(k)}, name[0].toUpperCase() + name.slice(1)));
  }
  show(Math.max(0, names.indexOf("access")));
  const [low, high] = slices.window_hu;
  return section("slices", "Does the vessel fit the image?",
    el("p", {}, "The line is the surface that the wires were pushed through. It should follow the edge of the bright lumen; where it does not, no number on this page holds there."),
    jumps,
    el("div", {class: "controls"}, el("label", {for: "place"}, "From access to target"), slider),
    state,
    frame,
    el("p", {class: "note"},
      `Cut ${known ? "in patient axes (R, L, A, P, S, I)" : "along the input's axes, which are not known to be the patient's"}, ${number(slices.size_px * slices.spacing_mm)}\u00a0mm wide, interpolated to ${number(slices.spacing_mm)}\u00a0mm; window ${number(low)} to ${number(high)}\u00a0HU (the image's own values where it has no HU). Coordinates in mm${known ? ", LPS" : ""}.`));
};
