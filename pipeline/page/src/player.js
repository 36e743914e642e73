// The chosen trial in the vessel: its wire played along the insertion, forces in color.
import {gradient} from "./colors.js";
import {el, section} from "./dom.js";
import {number, outcomeWord, planName, shown} from "./format.js";
import {farthest} from "./motion.js";
import {makeVessel} from "./vessel3d.js";

const kSpeed = 40; // mm of the hand's way per second

/** The wire between two stored shapes, nodes paired from the tip backwards. */
const between = (a, b, part) => {
  const count = b.nodes.length / 3, missing = count - a.nodes.length / 3;
  const nodes = new Float32Array(b.nodes.length), force = new Float32Array(count);
  for (let k = 0; k < count; ++k) {
    // What was still in the introducer starts at the access.
    const from = Math.max(0, k - missing);
    for (let i = 0; i < 3; ++i) {
      const start = a.nodes[3 * from + i] ?? b.nodes[i];
      nodes[3 * k + i] = start + part * (b.nodes[3 * k + i] - start);
    }
    const before = k >= missing ? a.force[from] : 0;
    force[k] = before + part * (b.force[k] - before);
  }
  const sections = a.sections && b.sections ? b.sections.map((to, k) => a.sections[k] + part * (to - a.sections[k])) : null;
  return {nodes, force, sections};
};

/** The shape at a part, 0 to 1, of the hand's way. */
const shapeAt = (shapes, part) => {
  const way = part * shapes[shapes.length - 1].way;
  const next = shapes.findIndex((shape) => shape.way >= way);
  if (next <= 0) return shapes[Math.max(0, next)];
  const a = shapes[next - 1], b = shapes[next];
  if (a.tools) return a; // two tools are not shown between shapes that were simulated
  // Pulled back, the wire is paired from its tip too.
  const [short, long] = a.nodes.length <= b.nodes.length ? [a, b] : [b, a];
  const gone = b.way > a.way ? (way - a.way) / (b.way - a.way) : 1;
  return between(short, long, short === a ? gone : 1 - gone);
};

/** The push that ends at a part of the hand's way. */
const pushAt = (pushes, part) => {
  const way = part * (pushes[pushes.length - 1]?.way ?? 0);
  return pushes.find((push) => push.way >= way - 1e-3) ?? pushes[pushes.length - 1];
};

/** Forces per triangle of one trial. */
const wallOf = (insertion, triangles) => {
  const forces = new Float32Array(triangles);
  const at = insertion.wallTriangle(), force = insertion.wallForce();
  at.forEach((triangle, k) => (forces[triangle] = force[k]));
  return forces;
};

const largest = (values) => values.reduce((a, b) => Math.max(a, b), 0);

export const vesselSection = (page, selection) => {
  const {trials, insertions} = page;
  const triangles = page.surface.triangles.length / 3;
  const limits = page.report.provenance.parameters.limits;

  // Controls.
  const pick = el("select", {id: "pick-trial", onchange: () => selection.set(Number(pick.value))});
  const group = (label, rows) =>
    rows.length
      ? el("optgroup", {label}, rows.map((t) => el("option", {value: t.id}, `${t.plan ? `${t.plan.rank}. ` : ""}${planName(t)}`)))
      : null;
  const byRank = trials.filter((t) => t.plan).sort((a, b) => a.plan.rank - b.plan.rank);
  const played = (t) => insertions.has(t.id);
  pick.append(
    ...[
      group("Ranked plans, whole insertion", byRank.filter(played)),
      group("Ranked plans, final shape", byRank.filter((t) => !played(t))),
      group("Not ranked, whole insertion", trials.filter((t) => !t.plan && played(t))),
      group("Not ranked, final shape", trials.filter((t) => !t.plan && !played(t))),
    ].filter(Boolean),
  );
  const wall = el("select", {id: "pick-wall", onchange: () => show()},
    el("option", {value: "plan"}, "forces of the chosen plan"),
    el("option", {value: "all"}, "largest force of any trial"),
    el("option", {value: "none"}, "no forces"));
  const moves = el("input", {type: "checkbox", id: "vessel-moves", checked: "", onchange: () => showWire()});
  const play = el("button", {type: "button", id: "play"}, "Play");
  const slider = el("input", {type: "range", id: "insertion", min: "0"});
  const state = el("output", {for: "insertion", id: "insertion-state"});
  const note = el("p", {class: "note"});
  const scaleEnd = el("span", {});
  const legend = el("div", {class: "legend"},
    el("span", {}, "contact force: 0"),
    el("span", {class: "bar", style: `background:${gradient()}`, role: "img", "aria-label": "color scale from no force, blue, to the largest, yellow"}),
    scaleEnd);

  // The view, or the picture of it where the browser draws no 3D.
  const frame = el("div", {class: "vessel"});
  const buttons = el("div", {class: "buttons", role: "group", "aria-label": "View of the vessel"});
  let vessel = null;
  const start = () => {
    try {
      vessel = makeVessel(frame, page);
    } catch {
      frame.classList.add("flat");
      frame.append(
        el("p", {}, "This browser draws no 3D (WebGL is off). The best plan of each wire, or its closest attempt:"),
        el("img", {src: page.picture, alt: "Two views of the vessel with the best plan of each wire"}),
      );
    }
    if (!vessel) return;
    const button = (text, press) => el("button", {type: "button", onclick: press}, text);
    buttons.append(
      button("From the front", () => vessel.view("front")),
      button("From the left", () => vessel.view("left")),
      button("From the feet", () => vessel.view("feet")),
      button("Closer", () => vessel.zoom(1.3)),
      button("Further", () => vessel.zoom(1 / 1.3)),
    );
  };

  // What is shown now.
  let trial = null, shapes = null, scale = 0;
  const toolsAtEnd = (push) => push?.tools?.map((tool) => tool.insertion) ?? null;
  const showStep = (push) =>
    Array.from(steps.children).forEach((row, k) =>
      k === push?.step && push.tools ? row.setAttribute("aria-current", "step") : row.removeAttribute("aria-current"));
  const showWire = () => {
    const way = Number(slider.value), end = Number(slider.max);
    const part = end > 0 ? way / end : 1;
    const push = pushAt(trial.pushes(), part);
    const insertion = part > 0 ? push?.insertion ?? 0 : 0;
    const shape = shapes ? shapeAt(shapes, part) : {nodes: trial.nodes(), force: null, sections: trial.sections()};
    vessel?.setSections(moves.checked ? shape.sections : null);
    vessel?.setWire(shape.nodes, shape.force, scale, shape.tools ?? toolsAtEnd(push));
    showStep(push);
    // A wire is called by its name where the script exchanges it.
    const wireName = (k) => (trial.exchanges > 0 ? shown(trial.tools.each[1 + k].name) : "wire");
    const ofTool = (name, tool) =>
      `${name} ${number(tool.insertion)}\u00a0mm in, hand ${number(tool.push)}\u00a0N, tip ${number(tool.tip)}\u00a0N`;
    const forces = push?.tools
      ? `${ofTool("catheter", push.tools[0])}; ${ofTool(wireName(push.wire), push.tools[1])}; largest contact ${number(push.peak)}\u00a0N`
      : push
      ? `hand ${number(push.push)}\u00a0N, tip ${number(push.tip)}\u00a0N, largest contact ${number(push.peak)}\u00a0N, all contacts ${number(push.total)}\u00a0N`
      : "never entered the vessel";
    const last = trial.pushes()[trial.pushes().length - 1]?.insertion ?? 0;
    const moved = page.motion && shape.sections ? `; the vessel moved by ${number(farthest(shape.sections))}\u00a0mm` : "";
    state.textContent = `${number(insertion)}\u00a0mm inserted, ${number(last)}\u00a0mm at the end: ${forces}${moved}`;
    slider.setAttribute("aria-valuetext", `${number(insertion)} mm inserted`);
  };
  const show = () => {
    const mode = wall.value;
    const stored = insertions.get(trial.id);
    const forces =
      mode === "all" ? page.surface.peakForce
      : mode === "plan" && stored ? wallOf(stored, triangles)
      : new Float32Array(triangles);
    // One scale for wire and wall.
    scale = Math.max(largest(forces), shapes ? largest(shapes.map((s) => largest(s.force))) : 0);
    scaleEnd.textContent = scale > 0 ? `${number(scale)}\u00a0N` : "no force";
    vessel?.setWall(forces, scale);
    showWire();
  };

  // Playing.
  let playing = false, last = 0;
  const setPlaying = (on) => {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
  };
  const step = (now) => {
    if (!playing) return;
    const end = Number(slider.max);
    slider.value = String(Math.min(end, Number(slider.value) + (kSpeed * (now - last)) / 1000));
    last = now;
    showWire();
    if (Number(slider.value) >= end) setPlaying(false);
    else requestAnimationFrame(step);
  };
  play.addEventListener("click", () => {
    if (playing) return setPlaying(false);
    if (Number(slider.value) >= Number(slider.max)) slider.value = "0";
    setPlaying(true);
    last = performance.now();
    requestAnimationFrame(step);
  });
  slider.addEventListener("input", () => {
    setPlaying(false);
    showWire();
  });

  const sentence = el("p", {class: "chosen", role: "status"});
  const steps = el("ol", {class: "steps"});
  const node = section("vessel", "The vessel and the wire",
    el("div", {class: "controls"},
      el("label", {for: "pick-trial"}, "Insertion "), pick,
      el("label", {for: "pick-wall"}, "Wall shows "), wall,
      page.motion ? el("label", {}, moves, " vessel as the wire moves it") : null),
    sentence,
    steps,
    frame,
    el("p", {class: "note", id: "vessel-help"},
      "Drag or use the arrow keys to turn, wheel or + and \u2212 to zoom. Letters name the patient's sides (R, L, A, P, S, I). " +
      "The white arrow is the introducer, the ring the target, the thin line the middle of the lumen. " +
      "The wire is drawn wider than it is, a catheter round it wider still; points are shown to 0.01\u00a0mm. Colors are forces of single nodes and triangles; a contact that the numbers tell spreads over several."),
    buttons,
    legend,
    el("div", {class: "controls player"}, play, el("label", {for: "insertion"}, "Insertion"), slider),
    state,
    note);

  const follow = () =>
    selection.follow((id) => {
      setPlaying(false);
      trial = trials[id];
      const stored = insertions.get(id);
      shapes = stored ? stored.shapes() : null;
      pick.value = String(id);
      const pushes = trial.pushes();
      const end = pushes.length ? pushes[pushes.length - 1].way : 0;
      slider.max = String(end);
      slider.step = String(end > 0 ? end / 256 : 1); // a power of two: the end is a step
      slider.value = String(end);
      slider.disabled = play.disabled = !shapes;
      note.textContent = shapes ? ""
        : "Of this trial the page has the final shape only, and no forces along the wire: insertions are kept of the best plans and of each wire's closest attempt.";
      const warn = trial.peak_tip_force_n > limits.tip_force_warn_n
        ? ` Its tip force passes the warning limit of ${number(limits.tip_force_warn_n)}\u00a0N.` : "";
      sentence.replaceChildren(
        el("strong", {}, trial.plan ? `Plan ${trial.plan.rank}` : `Trial ${id}, not ranked`), ": ",
        el("bdi", {}, planName(trial)),
        trial.plan ? `; ${outcomeWord(trial.outcome)}.` : `; ${trial.excluded ?? outcomeWord(trial.outcome)}.`, warn);
      steps.replaceChildren(...(trial.steps ?? []).map((step) =>
        el("li", {}, el("bdi", {}, shown(step.text)), step.otherwise ? el("span", {class: "note"}, `. ${shown(step.otherwise)}`) : null)));
      vessel?.setEntry(trial.direction);
      show();
    });
  return {node, start: () => (start(), follow())};
};
