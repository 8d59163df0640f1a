// A stage in space: a floor, cameras and skeletons, seen by an eye that turns around its middle, in perspective.
// Shared by the pages of finished runs and by the live page. Points are in metres in the world.
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const add = (a, b, s) => a.map((it, k) => it + s * b[k]);
const unit = (a) => a.map((it) => it / Math.hypot(...a));

// Colours on the stage, which is dark in both tones of a page, and on pictures.
export const COLOURS = { right: "#e69f00", left: "#56b4e9", centre: "#45c9b6", truth: "#9aa5b5", accent: "#ff5c5c", eye: "#8fa3bd", floor: "#27303d" };

// Colours of people beside the one who is shown in full, by their numbers.
const PEOPLE = ["#c58bff", "#ffd166", "#7ee081", "#ff9f8a", "#8ab4ff", "#f48fd0"];
export const colourOf = (id) => PEOPLE[(id - 1) % PEOPLE.length];

// The side of the body of a line between two joints, by their names.
export function sideOf(...names) {
  for (const name of names) {
    const side = ["right", "left"].find((it) => name.startsWith(it));
    if (side) return side;
  }
  return "centre";
}

export class Stage {
  // scene: { joints: names, limbs: pairs of their numbers, eyes: [{ name, at, axis }], up }
  constructor(canvas, scene, changed) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.changed = changed;
    this.view = { yaw: 0.6, pitch: 0.3, far: 5 };
    // Pixels of the screen for each of the page.
    this.sharp = 1;
    this.show(scene);
    this.listen();
  }

  show(scene) {
    this.scene = scene;
    // Axes of the stage: two along the floor, one against gravity.
    this.up = unit(scene.up);
    this.east = unit(cross(Math.abs(this.up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], this.up));
    this.north = cross(this.up, this.east);
    this.middle = [0, 0, 0];
  }

  // A point by how far it lies along the axes of the stage.
  place(east, north, up) {
    return add(add(add([0, 0, 0], this.east, east), this.north, north), this.up, up);
  }

  // How far a point lies along the axes of the stage.
  along(point) {
    return [dot(point, this.east), dot(point, this.north), dot(point, this.up)];
  }

  // From the world to the canvas; nothing for what is behind the eye.
  project(point) {
    const { canvas, view } = this;
    const [x, y, z] = this.along(add(point, this.middle, -1));
    const [c, s] = [Math.cos(view.yaw), Math.sin(view.yaw)];
    const [side, away] = [c * x + s * y, c * y - s * x];
    const [cp, sp] = [Math.cos(view.pitch), Math.sin(view.pitch)];
    const depth = view.far + cp * away - sp * z;
    const focal = 1.15 * Math.min(canvas.height, 1.2 * canvas.width);
    return depth < 0.2 ? null : [canvas.width / 2 + (focal * side) / depth, canvas.height / 2 - (focal * (cp * z + sp * away)) / depth];
  }

  line(from, to, colour, width) {
    const [a, b] = [this.project(from), this.project(to)];
    if (!a || !b) return;
    const { pen } = this;
    pen.strokeStyle = colour;
    pen.lineWidth = width * this.sharp;
    pen.lineCap = "round";
    pen.beginPath();
    pen.moveTo(...a);
    pen.lineTo(...b);
    pen.stroke();
  }

  clear() {
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  // The floor, in squares of a metre, and the cameras; gone: for each camera whether it has no part in the frame.
  drawStage(gone) {
    const { pen, up, east, north, scene, sharp } = this;
    const ground = add(this.middle, up, -0.9);
    for (let k = -4; k <= 4; k++) {
      const [e, n] = [add(ground, east, k), add(ground, north, k)];
      this.line(add(e, north, -4), add(e, north, 4), COLOURS.floor, 1);
      this.line(add(n, east, -4), add(n, east, 4), COLOURS.floor, 1);
    }
    scene.eyes.forEach((eye, k) => {
      const colour = gone[k] ? COLOURS.accent : COLOURS.eye;
      const right = unit(cross(eye.axis, up));
      const down = cross(eye.axis, right);
      const front = add(eye.at, eye.axis, 0.4);
      const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([r, d]) => add(add(front, right, 0.2 * r), down, 0.15 * d));
      corners.forEach((it, c) => {
        this.line(eye.at, it, colour, 1.5);
        this.line(it, corners[(c + 1) % 4], colour, 1.5);
      });
      const at = this.project(add(eye.at, up, 0.25));
      if (!at) return;
      pen.fillStyle = colour;
      pen.font = `${13 * sharp}px system-ui, sans-serif`;
      pen.fillText(eye.name, ...at);
    });
  }

  // The lines between joints that have a place; in one colour, or that of the side of the body.
  drawSkeleton(points, width, colour) {
    const { joints, limbs } = this.scene;
    for (const [from, to] of limbs) {
      if (!points[from] || !points[to]) continue;
      this.line(points[from], points[to], colour || COLOURS[sideOf(joints[from], joints[to])], width);
    }
  }

  // The number of a person above the head, or above the highest joint that is known.
  drawName(points, name, colour) {
    const known = points.filter(Boolean);
    if (!known.length) return;
    const top = known.reduce((a, b) => (this.along(b)[2] > this.along(a)[2] ? b : a));
    const at = this.project(top);
    if (!at) return;
    this.pen.fillStyle = colour;
    this.pen.font = `${15 * this.sharp}px system-ui, sans-serif`;
    this.pen.fillText(String(name), at[0] + 4, at[1] - 10);
  }

  // Where a point lies with 95 %: the outline of its ellipsoid; covariance as xx, xy, xz, yy, yz, zz in square metres.
  drawSpread(point, [xx, xy, xz, yy, yz, zz], colour) {
    const at = this.project(point);
    if (!at) return;
    const step = 0.005;
    const slopes = [0, 1, 2].map((axis) => {
      const moved = this.project(point.map((it, k) => it + (k === axis ? step : 0)));
      return moved ? [(moved[0] - at[0]) / step, (moved[1] - at[1]) / step] : [0, 0];
    });
    const c = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    const on = (i, j) => {
      let sum = 0;
      for (let a = 0; a < 3; a++) for (let b = 0; b < 3; b++) sum += slopes[a][i] * c[a][b] * slopes[b][j];
      return sum;
    };
    const [a, b, d] = [on(0, 0), on(0, 1), on(1, 1)];
    const [mean, apart] = [(a + d) / 2, Math.hypot((a - d) / 2, b)];
    // Of two dimensions 95 % lie within 2.45 standard deviations.
    const [long, short] = [mean + apart, mean - apart].map((it) => 2.45 * Math.sqrt(Math.max(it, 0)));
    if (!Number.isFinite(long) || long > 4 * this.canvas.width) return;
    const { pen } = this;
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = this.sharp;
    pen.beginPath();
    pen.ellipse(...at, Math.max(long, 1.5 * this.sharp), Math.max(short, 1.5 * this.sharp), Math.atan2(2 * b, a - d) / 2, 0, 2 * Math.PI);
    pen.globalAlpha = 0.25;
    pen.fill();
    pen.globalAlpha = 0.9;
    pen.stroke();
    pen.globalAlpha = 1;
  }

  turn(yaw, pitch) {
    this.view.yaw += yaw;
    this.view.pitch = Math.min(1.5, Math.max(-0.2, this.view.pitch + pitch));
    this.changed();
  }

  near(factor) {
    this.view.far = Math.min(20, Math.max(2, this.view.far * factor));
    this.changed();
  }

  // As many pixels as the screen has for it.
  fit() {
    const { canvas } = this;
    this.sharp = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(this.sharp * canvas.clientWidth));
    canvas.height = Math.max(1, Math.round(this.sharp * canvas.clientHeight));
    this.changed();
  }

  listen() {
    const { canvas } = this;
    canvas.onpointerdown = (it) => canvas.setPointerCapture(it.pointerId);
    canvas.onpointermove = (it) => {
      if (it.buttons) this.turn(0.008 * it.movementX, 0.008 * it.movementY);
    };
    canvas.onwheel = (it) => {
      it.preventDefault();
      this.near(Math.exp(0.001 * it.deltaY));
    };
    window.addEventListener("resize", () => this.fit());
  }
}
