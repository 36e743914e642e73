// The vessel's points where a wire has moved its cross-sections.

/** For points in turn, of which `motion` tells how many cross-sections each follows, which, and with
    what weights: gives, for displacements of the sections or null, where the points are then. */
export const makeCarrier = (motion, ...parts) => {
  let point = 0, entry = 0;
  const carriers = parts.map((rest) => {
    const first = {point, entry};
    for (const end = point + rest.length / 3; point < end; ++point) entry += motion.counts[point];
    return (sections) => {
      if (!sections) return rest;
      const moved = Float32Array.from(rest);
      let at = first.entry;
      for (let k = 0; k < rest.length / 3; ++k) {
        for (const end = at + motion.counts[first.point + k]; at < end; ++at) {
          for (let i = 0; i < 3; ++i) moved[3 * k + i] += motion.weights[at] * sections[3 * motion.nodes[at] + i];
        }
      }
      return moved;
    };
  });
  return (sections) => carriers.map((carry) => carry(sections));
};

/** The farthest that any cross-section has moved [mm]. */
export const farthest = (sections) => {
  let most = 0;
  for (let k = 0; sections && k < sections.length; k += 3) most = Math.max(most, Math.hypot(...sections.subarray(k, k + 3)));
  return most;
};
