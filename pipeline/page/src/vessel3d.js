// The vessel, a wire in it, entry and target, in 3D. Drawn only when something changed.
import {
  BufferAttribute, BufferGeometry, ColorManagement, ConeGeometry, DoubleSide, DynamicDrawUsage,
  Group, Line, LineBasicMaterial, LinearSRGBColorSpace, Mesh, MeshBasicMaterial, OrthographicCamera,
  RingGeometry, Scene, ShaderMaterial, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
import {OrbitControls} from "three/addons/controls/OrbitControls.js";
import {Line2} from "three/addons/lines/Line2.js";
import {LineGeometry} from "three/addons/lines/LineGeometry.js";
import {LineMaterial} from "three/addons/lines/LineMaterial.js";
import {forceRgb} from "./colors.js";
import {el} from "./dom.js";
import {makeCarrier} from "./motion.js";

const kPaper = 0x141a24;
const kEntryLength = 40; // mm at most
const kMargin = 1.15; // of the frame over the vessel, room for the introducer
const kEntryColor = 0xffffff, kTargetColor = 0xff9ecb;
const kTurn = Math.PI / 24, kZoom = 1.15; // of one key press

// Where the camera stands, in LPS; the head is up, and from the feet the front is.
const kViews = {front: [0, -1, 0], left: [1, 0, 0], feet: [0, -1e-3, -1]};

// Colors go to the screen as they are written.
ColorManagement.enabled = false;

// Seen from its side the vessel is more opaque, as in an x-ray; a forced triangle is more opaque
// from everywhere and takes the color of its force.
const kVertexShader = `
attribute vec4 force;
varying vec3 vNormal;
varying vec4 vForce;
void main() {
  vNormal = normalMatrix * normal;
  vForce = force;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;
const kFragmentShader = `
varying vec3 vNormal;
varying vec4 vForce;
void main() {
  float facing = abs(normalize(vNormal).z);
  vec3 tissue = vec3(0.98, 0.76, 0.68) * (0.6 + 0.4 * facing);
  float alpha = 0.10 + 0.55 * pow(1.0 - facing, 1.5);
  gl_FragColor = vec4(mix(tissue, vForce.rgb, vForce.a), max(alpha, 0.85 * vForce.a));
}`;

const makeVesselMesh = ({vertices, triangles}) => {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(vertices, 3));
  geometry.setIndex(new BufferAttribute(triangles, 1));
  geometry.computeVertexNormals();
  const force = new BufferAttribute(new Float32Array((vertices.length / 3) * 4), 4);
  force.setUsage(DynamicDrawUsage);
  geometry.setAttribute("force", force);
  const material = new ShaderMaterial({
    vertexShader: kVertexShader,
    fragmentShader: kFragmentShader,
    transparent: true,
    depthWrite: false,
    side: DoubleSide,
  });
  return new Mesh(geometry, material);
};

/** Colors each corner by the largest force of its triangles. */
const colorVessel = (mesh, forces, scale) => {
  const attribute = mesh.geometry.getAttribute("force");
  const index = mesh.geometry.getIndex().array;
  const corner = new Float32Array(attribute.count);
  for (let k = 0; k < index.length; ++k) corner[index[k]] = Math.max(corner[index[k]], forces[(k / 3) | 0]);
  for (let k = 0; k < corner.length; ++k) {
    const part = scale > 0 ? Math.min(1, corner[k] / scale) : 0;
    const [r, g, b] = forceRgb(part);
    // Even a small force shows where the wire touched.
    attribute.setXYZW(k, r, g, b, corner[k] > 0 ? 0.35 + 0.65 * part : 0);
  }
  attribute.needsUpdate = true;
};

const kCatheterRgb = [0.93, 0.93, 0.96];

/** How many of the points lie within so much of the line from its start [mm]. */
const nodesWithin = (nodes, length) => {
  const count = nodes.length / 3;
  let arc = 0;
  for (let k = 1; k < count; ++k) {
    arc += Math.hypot(...[0, 1, 2].map((i) => nodes[3 * k + i] - nodes[3 * k - 3 + i]));
    if (arc > length + 0.6 * (arc / k)) return k; // to the nearest point, half an edge off at most
  }
  return count;
};

const makeTarget = (target, radius) => {
  const group = new Group();
  group.add(new Mesh(new SphereGeometry(Math.max(0.6, 0.2 * radius), 24, 16), new MeshBasicMaterial({color: kTargetColor})));
  const ring = new Mesh(
    new RingGeometry(0.92 * radius, radius, 48),
    new MeshBasicMaterial({color: kTargetColor, side: DoubleSide}),
  );
  ring.name = "ring";
  group.add(ring);
  group.position.set(...target);
  return group;
};

const makeEntry = (access, direction, length) => {
  const group = new Group();
  const tip = new Vector3(...access), along = new Vector3(...direction).normalize();
  const start = tip.clone().addScaledVector(along, -length);
  const shaft = new LineGeometry();
  shaft.setPositions([...start.toArray(), ...tip.toArray()]);
  group.add(new Line2(shaft, new LineMaterial({color: kEntryColor, linewidth: 2.5})));
  const cone = new Mesh(new ConeGeometry(0.05 * length, 0.17 * length, 24), new MeshBasicMaterial({color: kEntryColor}));
  cone.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along);
  cone.position.copy(tip).addScaledVector(along, -0.085 * length);
  group.add(cone);
  return group;
};

const dispose = (object) =>
  object.traverse((part) => {
    part.geometry?.dispose();
    part.material?.dispose();
  });

/** Letters of the patient's sides at the right and at the top of the view. */
const sideLetter = (v) => {
  const size = [Math.abs(v.x), Math.abs(v.y), Math.abs(v.z)];
  const axis = size.indexOf(Math.max(...size));
  return ["RL", "AP", "IS"][axis][v.getComponent(axis) > 0 ? 1 : 0];
};

/** Throws where the browser has no WebGL. */
export const makeVessel = (frame, page) => {
  const canvas = el("canvas", {
    tabindex: "0",
    role: "img",
    "aria-label":
      "The vessel in 3D with the chosen wire. Arrow keys turn it, plus and minus zoom; the numbers are in the text below.",
    "aria-describedby": "vessel-help",
  });
  const renderer = new WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true});
  renderer.outputColorSpace = LinearSRGBColorSpace;
  renderer.setClearColor(kPaper);
  renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
  const labels = el("div", {class: "labels", "aria-hidden": "true"});
  frame.append(canvas, labels);

  // The scene.
  const scene = new Scene();
  const vessel = makeVesselMesh(page.surface);
  scene.add(vessel);
  const target = makeTarget(page.target, page.targetRadius);
  scene.add(target);
  const pathGeometry = new BufferGeometry();
  pathGeometry.setAttribute("position", new BufferAttribute(page.path, 3));
  scene.add(new Line(pathGeometry, new LineBasicMaterial({color: 0x8794a8})));
  let wire = null, entry = null;
  const carry = page.motion
    ? makeCarrier(page.motion, ...[page.surface.vertices, page.path, page.access, page.target].map((points) => Float32Array.from(points)))
    : null;

  // The camera looks at the middle of the vessel.
  vessel.geometry.computeBoundingBox();
  const box = vessel.geometry.boundingBox;
  const center = box.getCenter(new Vector3()), extent = box.getSize(new Vector3());
  const radius = Math.max(1, extent.length() / 2);
  const camera = new OrthographicCamera(-1, 1, 1, -1, 0.1, 20 * radius);
  camera.up.set(0, 0, 1);
  const controls = new OrbitControls(camera, canvas);

  const place = (text, point) => {
    const node = el("span", {}, text);
    labels.append(node);
    return {node, point: new Vector3(...point)};
  };
  const marks = [place("access", page.access), place("target", page.target)];
  const sides = {right: el("span", {class: "side right"}), top: el("span", {class: "side top"}),
                 left: el("span", {class: "side left"}), bottom: el("span", {class: "side bottom"})};
  labels.append(...Object.values(sides));

  const draw = () => {
    const width = frame.clientWidth, height = frame.clientHeight;
    target.getObjectByName("ring").quaternion.copy(camera.quaternion);
    renderer.render(scene, camera);
    for (const {node, point} of marks) {
      const seen = point.clone().project(camera);
      node.style.transform = `translate(${((seen.x + 1) / 2) * width + 10}px, ${((1 - seen.y) / 2) * height - 10}px)`;
    }
    const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
    const up = new Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
    sides.right.textContent = sideLetter(right);
    sides.left.textContent = sideLetter(right.negate());
    sides.top.textContent = sideLetter(up);
    sides.bottom.textContent = sideLetter(up.negate());
  };
  let asked = false;
  const redraw = () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      draw();
    });
  };
  controls.addEventListener("change", redraw);

  const resize = () => {
    const width = Math.max(1, frame.clientWidth), height = Math.max(1, frame.clientHeight);
    renderer.setSize(width, height, false);
    camera.top = radius * Math.max(1, height / width);
    camera.bottom = -camera.top;
    camera.right = (camera.top * width) / height;
    camera.left = -camera.right;
    camera.updateProjectionMatrix();
    draw();
  };
  /** So that the vessel's box fills the frame, as the camera sees it now. */
  const fit = () => {
    const half = (column) => {
      const axis = new Vector3().setFromMatrixColumn(camera.matrixWorld, column);
      return (Math.abs(axis.x) * extent.x + Math.abs(axis.y) * extent.y + Math.abs(axis.z) * extent.z) / 2;
    };
    camera.updateMatrixWorld();
    camera.zoom = Math.min(camera.right / half(0), camera.top / half(1)) / kMargin;
    camera.updateProjectionMatrix();
  };
  const view = (name) => {
    camera.position.copy(center).addScaledVector(new Vector3(...kViews[name]), 6 * radius);
    controls.target.copy(center);
    controls.update();
    fit();
    redraw();
  };
  const zoom = (factor) => {
    camera.zoom = Math.min(40, Math.max(0.5, camera.zoom * factor));
    camera.updateProjectionMatrix();
    redraw();
  };
  const turn = (across, upward) => {
    const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
    const offset = camera.position.clone().sub(controls.target);
    const turned = offset.clone().applyAxisAngle(camera.up, across).applyAxisAngle(right, upward);
    // Never over the pole.
    if (Math.abs(turned.clone().normalize().dot(camera.up)) > 0.995) return;
    camera.position.copy(controls.target).add(turned);
    controls.update();
    redraw();
  };
  const keys = {
    ArrowLeft: () => turn(-kTurn, 0), ArrowRight: () => turn(kTurn, 0),
    ArrowUp: () => turn(0, -kTurn), ArrowDown: () => turn(0, kTurn),
    "+": () => zoom(kZoom), "=": () => zoom(kZoom), "-": () => zoom(1 / kZoom),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });

  // First from where most of the vessel is seen.
  const {x, y, z} = extent;
  const seen = {front: x * z, left: y * z, feet: x * y};
  const widest = Object.keys(seen).reduce((a, b) => (seen[b] > seen[a] ? b : a));
  new ResizeObserver(resize).observe(frame);
  resize();
  view(widest);

  return {
    view,
    zoom,
    /** Shows a wire: points x, y, z in turn, a force per point or none, and the scale's end [N]. Of
        catheter and wire, how far each is in along the points [mm]: the catheter as a wider line. */
    setWire: (nodes, force, scale, tools = null) => {
      if (wire) scene.remove(wire), dispose(wire);
      wire = null;
      const line = (count, linewidth, rgbOf, inside = false) => {
        const geometry = new LineGeometry();
        geometry.setPositions(nodes.subarray(0, 3 * count));
        const colors = new Float32Array(3 * count);
        for (let k = 0; k < count; ++k) colors.set(rgbOf(force && scale > 0 ? force[k] / scale : 0), 3 * k);
        geometry.setColors(colors);
        const drawn = new Line2(geometry, new LineMaterial({linewidth, vertexColors: true, depthTest: !inside}));
        drawn.renderOrder = inside ? 1 : 0; // a wire in a catheter is seen, as on X-rays
        wire.add(drawn);
      };
      if (nodes.length >= 6) {
        wire = new Group();
        const all = nodes.length / 3;
        if (tools) {
          const [inCatheter, inWire] = tools.map((insertion) => nodesWithin(nodes, insertion));
          if (inCatheter > 1) line(inCatheter, 10, (part) => (part > 0 ? forceRgb(part) : kCatheterRgb));
          if (inWire > 1) line(inWire, 3, forceRgb, true);
        } else {
          line(all, 4.5, forceRgb);
        }
        scene.add(wire);
      }
      redraw();
    },
    /** Shows forces per triangle. */
    setWall: (forces, scale) => {
      colorVessel(vessel, forces, scale);
      redraw();
    },
    /** Shows the vessel, its path, access and target where its cross-sections have moved them; null: at
        rest. */
    setSections: (sections) => {
      if (!carry) return;
      const [vertices, path, access, to] = carry(sections);
      vessel.geometry.getAttribute("position").copyArray(vertices).needsUpdate = true;
      vessel.geometry.computeVertexNormals();
      pathGeometry.getAttribute("position").copyArray(path).needsUpdate = true;
      marks[0].point.set(...access);
      marks[1].point.set(...to);
      target.position.set(...to);
      redraw();
    },
    setEntry: (direction) => {
      if (entry) scene.remove(entry), dispose(entry);
      entry = makeEntry(page.access, direction, Math.min(kEntryLength, 0.35 * radius));
      scene.add(entry);
      redraw();
    },
  };
};
