// Draws the skeleton in space: an orbiting eye around the middle of the stage, in perspective.
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const element = (name) => document.getElementById(name);
const canvas = element("space");
const pen = canvas.getContext("2d");
// Pixels of the screen for each of the page.
let sharp = 1;
const metres = (mm) => mm && mm.map((it) => it / 1000);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const add = (a, b, s) => a.map((it, k) => it + s * b[k]);
const unit = (a) => a.map((it) => it / Math.hypot(...a));

// Axes of the stage: two along the floor, one against gravity.
const up = unit(data.up);
const east = unit(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
const north = cross(up, east);
const moments = data.moments.map((it) => ({ ...it, found: it.found.map(metres), truth: it.truth.map(metres) }));
const eyes = data.eyes.map((it) => ({ ...it, at: metres(it.at) }));
const points = moments.flatMap((it) => it.truth.concat(it.found.filter(Boolean)));
const among = (axis, share) => {
  const sorted = points.map((it) => dot(it, axis)).sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor(share * (sorted.length - 1))] : 0;
};
const floor = among(up, 0.01);
const middle = [[east, among(east, 0.5)], [north, among(north, 0.5)], [up, floor + 0.9]]
  .reduce((sum, [axis, at]) => add(sum, axis, at), [0, 0, 0]);

const view = { yaw: 0.6, pitch: 0.3, far: 5 };
let nth = 0;
let playing = true;

// From the world to the canvas; nothing for what is behind the eye.
function project(point) {
  const at = add(point, middle, -1);
  const [x, y, z] = [dot(at, east), dot(at, north), dot(at, up)];
  const [c, s] = [Math.cos(view.yaw), Math.sin(view.yaw)];
  const [side, away] = [c * x + s * y, c * y - s * x];
  const [cp, sp] = [Math.cos(view.pitch), Math.sin(view.pitch)];
  const depth = view.far + cp * away - sp * z;
  const focal = 1.15 * Math.min(canvas.height, 1.2 * canvas.width);
  return depth < 0.2 ? null : [canvas.width / 2 + (focal * side) / depth, canvas.height / 2 - (focal * (cp * z + sp * away)) / depth];
}

function line(from, to, colour, width) {
  const [a, b] = [project(from), project(to)];
  if (!a || !b) return;
  pen.strokeStyle = colour;
  pen.lineWidth = width * sharp;
  pen.beginPath();
  pen.moveTo(...a);
  pen.lineTo(...b);
  pen.stroke();
}

function drawStage(moment) {
  const ground = add(middle, up, -0.9);
  for (let k = -4; k <= 4; k++) {
    const [e, n] = [add(ground, east, k), add(ground, north, k)];
    line(add(e, north, -4), add(e, north, 4), "#27303d", 1);
    line(add(n, east, -4), add(n, east, 4), "#27303d", 1);
  }
  eyes.forEach((eye, k) => {
    const colour = moment.views[k] === null ? "#8fa3bd" : "#ff5c5c";
    const right = unit(cross(eye.axis, up));
    const down = cross(eye.axis, right);
    const front = add(eye.at, eye.axis, 0.4);
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([r, d]) => add(add(front, right, 0.2 * r), down, 0.15 * d));
    corners.forEach((it, c) => {
      line(eye.at, it, colour, 1.5);
      line(it, corners[(c + 1) % 4], colour, 1.5);
    });
    const at = project(add(eye.at, up, 0.25));
    if (!at) return;
    pen.fillStyle = colour;
    pen.font = `${13 * sharp}px system-ui, sans-serif`;
    pen.fillText(eye.name, ...at);
  });
}

function colourOf(from, to) {
  const side = (joint) => ["right", "left"].find((it) => data.joints[joint].startsWith(it));
  return { right: "#e69f00", left: "#56b4e9" }[side(from) || side(to)] || "#45c9b6";
}

function draw() {
  const moment = moments[nth];
  pen.clearRect(0, 0, canvas.width, canvas.height);
  if (!moment) return;
  drawStage(moment);
  for (const [from, to] of data.limbs) {
    if (element("truth").checked && moment.truth.length) line(moment.truth[from], moment.truth[to], "#9aa5b5", 2);
    if (moment.found[from] && moment.found[to]) line(moment.found[from], moment.found[to], colourOf(from, to), 4);
  }
  const gone = eyes.filter((_, k) => moment.views[k] !== null).map((it) => it.name);
  element("said").textContent = `frame ${moment.frame}, ${moment.seconds.toFixed(1)} s` + (gone.length ? `, without ${gone.join(", ")}` : "");
  element("at").value = nth;
}

function play(on) {
  playing = on;
  element("play").textContent = on ? "pause" : "play";
  clock = null;
}

// The time of the run when the clock of the browser was at 0, while it plays.
let clock = null;
function turn(now) {
  if (playing && moments.length > 1) {
    const seconds = now / 1000;
    if (clock === null) clock = moments[nth].seconds - seconds;
    if (nth + 1 >= moments.length) {
      if (seconds + clock > moments[nth].seconds + 1) [nth, clock] = [0, null];
    } else {
      while (nth + 1 < moments.length && moments[nth + 1].seconds <= seconds + clock) nth++;
    }
    draw();
  }
  requestAnimationFrame(turn);
}

element("at").max = Math.max(moments.length - 1, 0);
element("play").onclick = () => play(!playing);
element("truth").onchange = draw;
element("at").oninput = () => {
  play(false);
  nth = Number(element("at").value);
  draw();
};
canvas.onpointerdown = (it) => canvas.setPointerCapture(it.pointerId);
canvas.onpointermove = (it) => {
  if (!it.buttons) return;
  view.yaw += 0.008 * it.movementX;
  view.pitch = Math.min(1.5, Math.max(-0.2, view.pitch + 0.008 * it.movementY));
  draw();
};
canvas.onwheel = (it) => {
  it.preventDefault();
  view.far = Math.min(20, Math.max(2, view.far * Math.exp(0.001 * it.deltaY)));
  draw();
};
// As many pixels as the screen has for it.
function fit() {
  sharp = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(sharp * canvas.clientWidth));
  canvas.height = Math.max(1, Math.round(sharp * canvas.clientHeight));
  draw();
}
window.addEventListener("resize", fit);
fit();
requestAnimationFrame(turn);
