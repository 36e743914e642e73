// A volume with a bright tube and a case on it, run by wireplan in some seconds. One wire's name is
// such as would do harm if a page took it for HTML or script.
import {execFileSync} from "node:child_process";
import {mkdirSync, writeFileSync} from "node:fs";
import {join} from "node:path";

/** A case of this name is refused; the made-up page has it. */
export const hostileCase = `</script><script>window.harmed=1</script><!-- "quotes" 'and' &amp; %WIREPLAN_SCENE%`;
export const hostileWire = `<img src=x onerror="window.harmed=2">\u202egpj.exe\u2028`;

const tubeVolume = () => {
  const size = [36, 36, 60], values = new Int16Array(size[0] * size[1] * size[2]);
  let k = 0;
  for (let z = 0; z < size[2]; ++z) {
    for (let y = 0; y < size[1]; ++y) {
      for (let x = 0; x < size[0]; ++x) values[k++] = Math.hypot(x - 17.5, y - 17.5) < 5 ? 400 : 40;
    }
  }
  const header =
    "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\n" +
    `sizes: ${size.join(" ")}\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n` +
    "kinds: domain domain domain\nendian: little\nencoding: raw\nspace origin: (-17.5,-17.5,0)\n\n";
  return Buffer.concat([Buffer.from(header, "latin1"), Buffer.from(values.buffer)]);
};

const smallCase = (changes) => ({
  schema: "wireplan.case/1",
  name: "small",
  volume: {path: "ct.nrrd"},
  segmentation: {lower_hu: 200, upper_hu: 600},
  surface: {edge_length_mm: 2},
  insertion: {length_mm: 45, step_mm: 2, element_length_mm: 2},
  ...changes,
});
const wire = (name, stiffness) => ({
  name, diameter_mm: 0.889,
  sections: [{length_mm: 200, bending_stiffness_n_mm2: stiffness}],
});

/** Runs a case in `folder` and gives its page. */
const run = (program, folder, given) => {
  mkdirSync(folder, {recursive: true});
  writeFileSync(join(folder, "ct.nrrd"), tubeVolume());
  writeFileSync(join(folder, "case.json"), JSON.stringify(given));
  execFileSync(program, ["run", folder, "-o", join(folder, "out"), "--cache", join(folder, "cache")], {stdio: "pipe"});
  return join(folder, "out", "report.html");
};

export const runSmallCase = (program, folder) => run(program, folder, smallCase({
  access: {point_mm: [0, 0, 8], inclination_deg: [10, 25], azimuth_deg: [0, 90]},
  target: {point_mm: [0, 0, 45], radius_mm: 6},
  wires: [wire(hostileWire, 50), wire("plain", 5)],
}));

/** A wire that leans on a soft tube and moves it. */
export const runSmallMoving = (program, folder) => run(program, folder, smallCase({
  access: {point_mm: [0, 0, 8], inclination_deg: [25]},
  target: {point_mm: [0, 0, 45]},
  wall: {support_kpa_per_mm: 0.05},
  wires: [wire("stiff", 400)],
  robustness: {repeats: 2},
}));

/** From both ends of the tube to two places between. */
export const runSmallSections = (program, folder) => run(program, folder, smallCase({
  accesses: [
    {name: "from below", point_mm: [0, 0, 8], inclination_deg: [10]},
    {name: "from above", point_mm: [0, 0, 52], inclination_deg: [10]},
  ],
  targets: [{name: "low", point_mm: [0, 0, 25]}, {name: "high", point_mm: [0, 0, 38]}],
  wires: [wire("plain", 5)],
}));
