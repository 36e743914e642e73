// What the program put into the page, decoded.

const parse = (id) => JSON.parse(document.getElementById(id).textContent);

const bytes = (text) => {
  const binary = atob(text);
  const array = new Uint8Array(binary.length);
  for (let k = 0; k < binary.length; ++k) array[k] = binary.charCodeAt(k);
  return array.buffer;
};

export const floats = (text) => new Float32Array(bytes(text));

/** With the way that the hand has gone so far, in and back, which never falls; of several tools, which
    move by turns, so much for `each`. */
const alongWay = (steps, each = 0) => {
  let way = 0, last = 0;
  for (const step of steps) {
    way += each || Math.abs(step.insertion - last);
    last = step.insertion;
    step.way = way;
  }
  return steps;
};

/** Decoded when first asked for. */
const lazy = (make) => {
  let value;
  return () => (value ??= make());
};

/** The report, or the overview of several. */
export const readReport = () => parse("data-report");

export const readPage = () => {
  const report = readReport();
  const scene = parse("data-scene");
  const timing = parse("data-timing");

  // Points are 16 bit numbers over the scene's box.
  const {low_mm: low, size_mm: size} = scene.box;
  const points = (text) => {
    const steps = new Uint16Array(bytes(text));
    const values = new Float32Array(steps.length);
    for (let k = 0; k < steps.length; ++k) values[k] = low[k % 3] + (steps[k] / 65535) * size[k % 3];
    return values;
  };
  const indices = (text) => new Uint32Array(bytes(text));
  // How far the vessel's cross-sections have moved [mm], where they do.
  const sections = (stored) => (stored.sections ? floats(stored.sections) : null);

  // Errors that refining found, and ranks, by trial.
  const errors = new Map(report.numerics.plans.map((row) => [row.trial, row]));
  const ranked = new Map(report.ranking.map((plan) => [plan.trial, plan]));
  const excluded = new Map(report.excluded.map((row) => [row.trial, row.reason]));

  const trials = report.trials.map((row, k) => {
    const stored = scene.trials[k];
    return {
      ...row,
      errors: errors.get(row.id) ?? {},
      plan: ranked.get(row.id) ?? null,
      excluded: excluded.get(row.id) ?? null,
      direction: stored.direction,
      nodes: lazy(() => points(stored.nodes)),
      sections: lazy(() => sections(stored)),
      pushes: lazy(() => {
        const values = floats(stored.push), tools = stored.tools ? floats(stored.tools) : null;
        return alongWay(Array.from({length: values.length / 5}, (_, i) => {
          const [insertion, push, tip, peak, total] = values.subarray(5 * i, 5 * i + 5);
          const row = tools ? tools.subarray(7 * i, 7 * i + 7) : null;
          const tool = (k) => ({insertion: row[k], push: row[k + 1], tip: row[k + 2]});
          // Which of the script's wires is in the catheter: 0 the first.
          const wire = (stored.exchanges ?? []).filter((from) => i >= from).length;
          return {insertion, push, tip, peak, total, step: row ? row[0] : 0, tools: row ? [tool(1), tool(4)] : null, wire};
        }), tools ? 2 : 0);
      }),
    };
  });

  const insertions = new Map(
    scene.insertions.map((row) => [
      row.trial,
      {
        shapes: lazy(() =>
          alongWay(row.shapes.map((shape) => ({
            insertion: shape.insertion_mm,
            nodes: points(shape.nodes),
            force: floats(shape.force_n),
            sections: sections(shape),
            tools: shape.tools_mm ?? null,
          })), row.shapes[0]?.tools_mm ? 5 : 0),
        ),
        wallTriangle: lazy(() => indices(row.wall_triangle)),
        wallForce: lazy(() => floats(row.wall_force_n)),
      },
    ]),
  );

  return {
    report,
    timing,
    trials,
    insertions,
    access: scene.access_mm,
    target: scene.target_mm,
    targetRadius: scene.target_radius_mm,
    // Without a radius the target is a cross-section of its vessel.
    atSection: report.provenance.parameters.target?.radius_mm === undefined,
    surface: {
      vertices: points(scene.surface.vertices),
      triangles: indices(scene.surface.triangles),
      peakForce: floats(scene.surface.peak_force_n),
    },
    path: points(scene.path),
    motion: scene.motion ? {
      counts: new Uint8Array(bytes(scene.motion.counts)),
      nodes: new Uint16Array(bytes(scene.motion.nodes)),
      weights: floats(scene.motion.weights),
    } : null,
    panels: scene.panels,  // each decodes its own
    picture: `data:image/png;base64,${scene.picture_png}`,
  };
};
