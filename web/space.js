// The scene: cameras, tie points coloured by residual, error vectors of check and control points.

import { BufferGeometry, CanvasTexture, Color, ConeGeometry, CylinderGeometry, Float32BufferAttribute, InstancedMesh,
  LineBasicMaterial, LineSegments, Matrix4, MeshBasicMaterial, Points, PointsMaterial, Quaternion, Scene, Sprite,
  SpriteMaterial, Vector3, WebGLRenderer } from "./vendor/three.module.min.js";
import { Orbit } from "./orbit.js";
import { extent, quantile, roundBelow } from "./space_data.js";

/** Colours of the flights as in the figures (src/report/style.rs); they repeat. */
const FLIGHTS = ["#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9"];
const FLIGHTS_DARK = ["#4AA8E0", "#F58044", "#2FC194", "#E69F00", "#CC79A7", "#9CD3F2"];
const CHECK = { light: "#222222", dark: "#E4E8EC" };
const CONTROL = "#8A8A8A";
/** What is brushed, as everywhere on the page. */
const BRUSHED = { light: "#C2007A", dark: "#FF6CC0" };
/** Light to dark on a light ground, dark to light on a dark one: what is large stands out. */
const RAMPS = { light: ["#C6DBEF", "#6BAED6", "#2171B5", "#08306B"],
  dark: ["#15385C", "#2171B5", "#6BAED6", "#F0F8FF"] };

const shade = (look) => (look.dark ? "dark" : "light");

export class Space {
  constructor(canvas) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.scene = new Scene();
    this.orbit = new Orbit(canvas, () => this.render());
    this.parts = [];
  }

  resize(width, height) {
    this.renderer.setSize(width, height, false);
    this.orbit.reshape(width / height);
    this.render();
  }

  render() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.renderer.render(this.scene, this.orbit.camera);
    });
  }

  /**
   * Shows a step. `look`: dark, brushed (set of images, or null), factor of the error vectors and end of the colours
   * (null: found here).
   * Gives back what the legend has to say.
   */
  show(data, look) {
    for (const part of this.parts) {
      this.scene.remove(part);
      part.geometry?.dispose();
      part.material.map?.dispose();
      part.material.dispose();
    }
    const { centre, radius, ends, places } = extent(data);
    this.radius = radius;
    if (!this.orbit.radius) this.orbit.look(new Vector3(...centre), radius, places);
    const errors = [data.checks, data.control].flatMap((points) => lengths(points));
    const factor = look.factor ?? roundBelow((0.25 * radius) / (quantile(errors, 0.9) || radius));
    const rms = data.ties.of("rms_px");
    const end = look.end ?? (quantile(Array.from({ length: data.ties.rows }, (_, row) => rms(row)), 0.95) || 1);
    const spacing = roundBelow(radius / 4);
    const box = ends.map(([low, high]) => [Math.floor(low / spacing) * spacing, Math.ceil(high / spacing) * spacing]);
    box[2][0] = ends[2][0];
    this.renderer.setClearColor(look.dark ? "#14181c" : "#ffffff");
    this.parts = [this.grid(box, spacing, look), ...this.axes(box, spacing, look), this.ties(data.ties, end, look),
      this.stations(data.stations, radius, look),
      ...this.surveyed(data.checks, factor, CHECK[shade(look)], look),
        ...this.surveyed(data.control, factor, CONTROL, look)].filter(Boolean);
    this.scene.add(...this.parts);
    this.render();
    return { factor, end, spacing };
  }

  /** Lines of the plan at the lowest height, over the box of what there is. */
  grid(box, spacing, look) {
    const [[west, east], [south, north]] = box;
    const low = box[2][0];
    const places = [];
    for (let x = west; x < east + spacing / 2; x += spacing) places.push(x, south, low, x, north, low);
    for (let y = south; y < north + spacing / 2; y += spacing) places.push(west, y, low, east, y, low);
    return lines(places, look.dark ? "#2b333b" : "#e2e5e8");
  }

  /** East and north, named, at the south-western corner of the grid. */
  axes(box, spacing, look) {
    const corner = [box[0][0], box[1][0], box[2][0]];
    const ink = look.dark ? "#d8dde2" : "#222222";
    const ends = [[2 * spacing, 0], [0, 2 * spacing]].map(([e, n]) => [corner[0] + e, corner[1] + n, corner[2]]);
    return [lines(ends.flatMap((end) => [...corner, ...end]), ink),
      ...ends.map((end, i) => label("EN"[i], end, 0.07 * this.radius, ink))];
  }

  ties(ties, end, look) {
    const rms = ties.of("rms_px");
    const brushed = ties.of("brushed");
    const ramp = RAMPS[shade(look)].map((hex) => new Color(hex));
    const mark = new Color(BRUSHED[shade(look)]);
    const colour = new Color();
    const [places, colours] = [[], []];
    for (let row = 0; row < ties.rows; row++) {
      const t = Math.min(0.9999, rms(row) / end) * (ramp.length - 1);
      colour.copy(ramp[Math.floor(t)] ?? ramp[0]).lerp(ramp[Math.floor(t) + 1] ?? ramp[0], t % 1 || 0);
      if (brushed && look.brushed) colour.copy(brushed(row) > 0 ? mark : ramp[0]);
      places.push(...ties.place(row));
      colours.push(colour.r, colour.g, colour.b);
    }
    return cloud(places, { size: ties.rows > 20000 ? 1.6 : 2.6, vertexColors: true }, colours);
  }

  /** A pyramid for each image: its base where the picture is, an edge longer at the top of the picture. */
  stations(stations, radius, look) {
    const size = Math.min(0.035 * radius, 1.6 * spread(stations));
    const axis = stations.triple("ax", "ay", "az");
    const upward = stations.triple("ux", "uy", "uz");
    const flight = stations.of("flight");
    const flights = look.dark ? FLIGHTS_DARK : FLIGHTS;
    const [places, colours] = [[], []];
    for (let row = 0; row < stations.rows; row++) {
      const c = new Vector3(...stations.place(row));
      const a = new Vector3(...axis(row));
      const u = new Vector3(...upward(row));
      const right = new Vector3().crossVectors(a, u);
      const corner = (x, y) => c.clone().addScaledVector(a, size).addScaledVector(right, 0.66 * size * x)
        .addScaledVector(u, 0.5 * size * y);
      const [p, q, r, s] = [corner(-1, 1), corner(1, 1), corner(1, -1), corner(-1, -1)];
      const tip = c.clone().addScaledVector(a, size).addScaledVector(u, 0.8 * size);
      const chosen = !look.brushed || look.brushed.has(row);
      const colour = new Color(!chosen ? (look.dark ? "#3a424a" : "#cfd3d7") : look.brushed ? BRUSHED[shade(look)]
        : flights[(flight?.(row) ?? 0) % flights.length]);
      for (const [from, to] of [[c, p], [c, q], [c, r], [c, s], [p, q], [q, r], [r, s], [s, p], [p, tip], [tip, q]]) {
        places.push(from.x, from.y, from.z, to.x, to.y, to.z);
        for (let k = 0; k < 2; k++) colours.push(colour.r, colour.g, colour.b);
      }
    }
    return lines(places, null, colours);
  }

  /** Surveyed points and their errors; those without a brushed mark are dimmed. */
  surveyed(points, factor, colour, look) {
    const brushed = look.brushed && points.of("brushed");
    if (!brushed) return this.vectors(points, factor, colour);
    const dim = look.dark ? "#3a424a" : "#cfd3d7";
    return [[false, dim], [true, BRUSHED[shade(look)]]]
      .flatMap(([wanted, own]) => this.vectors(points, factor, own, (row) => brushed(row) > 0 === wanted));
  }

  /** A shaft and a head for each error, so that the direction is seen from every side. */
  vectors(points, factor, colour, wanted = () => true) {
    const error = points.triple("dx", "dy", "dz");
    const rows = Array.from({ length: points.rows }, (_, row) => row).filter(wanted);
    const known = rows.filter((row) => error(row).every(Number.isFinite));
    const thick = 0.0035 * this.radius;
    const material = () => new MeshBasicMaterial({ color: colour });
    const shafts = new InstancedMesh(new CylinderGeometry(thick, thick, 1, 6).translate(0, 0.5, 0), material(),
      known.length);
    const heads = new InstancedMesh(new ConeGeometry(2.6 * thick, 1, 8).translate(0, -0.5, 0), material(),
      known.length);
    const up = new Vector3(0, 1, 0);
    known.forEach((row, i) => {
      const from = new Vector3(...points.place(row));
      const along = new Vector3(...error(row)).multiplyScalar(factor);
      const length = along.length() || 1e-9;
      const turn = new Quaternion().setFromUnitVectors(up, along.clone().divideScalar(length));
      const head = Math.min(0.5 * length, 7 * thick);
      shafts.setMatrixAt(i, new Matrix4().compose(from, turn, new Vector3(1, length - head, 1)));
      heads.setMatrixAt(i, new Matrix4().compose(from.add(along), turn,
        new Vector3(Math.min(1, length / thick / 6), head, Math.min(1, length / thick / 6))));
    });
    return [cloud(rows.flatMap((row) => points.place(row)), { size: points.rows > 500 ? 2.5 : 4.5, color: colour }),
      shafts, heads];
  }

  /** From metres about the block's origin to the picture, column by column. */
  matrix() {
    const { projectionMatrix, matrixWorldInverse } = this.orbit.camera;
    return new Matrix4().multiplyMatrices(projectionMatrix, matrixWorldInverse).toArray();
  }

  /** Place of a point of the block on the canvas, px of the screen. */
  project(place) {
    const canvas = this.renderer.domElement;
    const at = new Vector3(...place).project(this.orbit.camera);
    return [((at.x + 1) / 2) * canvas.clientWidth, ((1 - at.y) / 2) * canvas.clientHeight, at.z];
  }
}

function lengths(points) {
  const error = points.triple("dx", "dy", "dz");
  return Array.from({ length: points.rows }, (_, row) => Math.hypot(...error(row)));
}

/** Median distance from a station to the next one. */
function spread(stations) {
  const steps = Array.from({ length: Math.max(0, stations.rows - 1) },
    (_, row) => Math.hypot(...stations.place(row).map((value, k) => value - stations.place(row + 1)[k])));
  return quantile(steps, 0.5) || Infinity;
}

function geometry(places, colours) {
  const shape = new BufferGeometry();
  shape.setAttribute("position", new Float32BufferAttribute(places, 3));
  if (colours) shape.setAttribute("color", new Float32BufferAttribute(colours, 3));
  return shape;
}

function cloud(places, look, colours) {
  return places.length ? new Points(geometry(places, colours), new PointsMaterial({ ...look, sizeAttenuation: false }))
    : null;
}

function lines(places, colour, colours) {
  return places.length ? new LineSegments(geometry(places, colours),
    new LineBasicMaterial(colours ? { vertexColors: true } : { color: colour })) : null;
}

function label(text, place, size, ink) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = canvas.getContext("2d");
  context.font = "bold 44px sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = ink;
  context.fillText(text, 32, 34);
  const sprite = new Sprite(new SpriteMaterial({ map: new CanvasTexture(canvas), depthTest: false }));
  sprite.position.set(...place);
  sprite.scale.set(size, size, 1);
  return sprite;
}
