// Looking round: a camera that turns about a point, heights upright. Drag turns, Shift or the right button shifts, the
// wheel comes closer.

import { PerspectiveCamera, Vector3 } from "./vendor/three.module.min.js";

const STEEPEST = Math.PI / 2 - 0.01;

export class Orbit {
  /** `changed` is called when the view did. */
  constructor(canvas, changed) {
    this.camera = new PerspectiveCamera(40, 1, 0.1, 10);
    this.camera.up.set(0, 0, 1);
    this.target = new Vector3();
    this.changed = changed;
    this.canvas = canvas;
    canvas.addEventListener("pointerdown", (event) => this.drag(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.closer(Math.exp(event.deltaY * 0.001));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", () => this.home && this.look(...this.home));
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** Looks at `centre` across the longer side of what lies at `places`, from where all of it is seen. */
  look(centre, radius, places) {
    this.home = [centre, radius, places];
    this.target.copy(centre);
    this.radius = radius;
    this.azimuth = across(places) + 0.25;
    this.elevation = 0.5;
    this.distance = radius;
    this.untouched = true;
    this.place();
    const [right, up, back] = [0, 1, 2].map((k) => new Vector3().setFromMatrixColumn(this.camera.matrixWorld, k));
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    const from = places.map((place) => new Vector3(...place).sub(this.target));
    const needed = from.map((q) => q.dot(back) + Math.max(Math.abs(q.dot(up)) / half,
      Math.abs(q.dot(right)) / half / this.camera.aspect));
    this.distance = 1.08 * needed.reduce((most, one) => Math.max(most, one), 0);
    this.place();
  }

  place() {
    const flat = this.distance * Math.cos(this.elevation);
    this.camera.position.set(this.target.x + flat * Math.cos(this.azimuth),
      this.target.y + flat * Math.sin(this.azimuth), this.target.z + this.distance * Math.sin(this.elevation));
    this.camera.near = this.distance / 500;
    this.camera.far = this.distance + 20 * this.radius;
    this.camera.lookAt(this.target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.changed();
  }

  /** The window has another shape: all of the block is shown again, unless one looked round meanwhile. */
  reshape(aspect) {
    this.camera.aspect = aspect;
    if (this.untouched) this.look(...this.home);
    else this.camera.updateProjectionMatrix();
  }

  turn(by, up) {
    this.untouched = false;
    this.azimuth -= by;
    this.elevation = Math.max(-STEEPEST, Math.min(STEEPEST, this.elevation + up));
    this.place();
  }

  shift(right, up) {
    this.untouched = false;
    const x = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    const y = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    this.target.addScaledVector(x, -right * this.distance).addScaledVector(y, up * this.distance);
    this.place();
  }

  closer(factor) {
    this.untouched = false;
    this.distance = Math.max(this.radius / 200, Math.min(20 * this.radius, this.distance * factor));
    this.place();
  }

  drag(event) {
    if (!this.radius) return;
    const shifts = event.shiftKey || event.button === 2;
    const height = this.canvas.clientHeight;
    let [x, y] = [event.clientX, event.clientY];
    this.canvas.setPointerCapture(event.pointerId);
    const move = (now) => {
      const [dx, dy] = [(now.clientX - x) / height, (now.clientY - y) / height];
      [x, y] = [now.clientX, now.clientY];
      if (shifts) this.shift(0.73 * dx, 0.73 * dy);
      else this.turn(3 * dx, 3 * dy);
    };
    const end = () => this.canvas.removeEventListener("pointermove", move);
    this.canvas.addEventListener("pointermove", move);
    this.canvas.addEventListener("pointerup", end, { once: true });
    this.canvas.addEventListener("pointercancel", end, { once: true });
  }

  key(event) {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] }[event.key];
    if (turns) this.turn(...turns);
    else if (event.key === "+" || event.key === "=") this.closer(0.85);
    else if (event.key === "-") this.closer(1.18);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}

/** Direction in plan across the longer axis of some places, from the south. */
function across(places) {
  const mean = [0, 1].map((k) => places.reduce((sum, place) => sum + place[k], 0) / places.length);
  let [xx, xy, yy] = [0, 0, 0];
  for (const place of places) {
    const [x, y] = [place[0] - mean[0], place[1] - mean[1]];
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  const direction = Math.atan2(2 * xy, xx - yy) / 2 - Math.PI / 2;
  return Math.sin(direction) > 0.01 ? direction + Math.PI : direction;
}
