// The pictures of all cameras, with the poses found in them and epipolar lines.
import { COLOURS, colourOf, sideOf } from "./stage.js";

// Largest number of pictures that wait for the result of their frame, and of results that are kept.
const MOST_WAITING = 8;
const MOST_MOMENTS = 120;
// Distance up to which a click selects a joint, as a share of the picture's width.
const NEAR = 0.05;
// Time after which a request for lines is repeated if there is no answer.
const PATIENCE_MS = 1000;

export class Pictures {
  // ask: sends a request; marked: called with the clicked joint, or null for a point without a joint
  constructor(place, ask, marked) {
    this.place = place;
    this.ask = ask;
    this.marked = marked;
    this.views = [];
    this.moments = new Map();
    this.newest = null;
    this.lines = [];
    // Number of changes of the lines.
    this.nLines = 0;
    this.point = null;
    this.large = null;
    this.poses = true;
    this.on = true;
    this.isLive = true;
    // Time of the pending request for lines, and whether other lines are wanted since then.
    this.asked = null;
    this.isChanged = false;
  }

  show(scene, isLive) {
    this.scene = scene;
    this.isLive = isLive;
    this.moments.clear();
    this.newest = null;
    this.lines = [];
    this.point = null;
    for (const view of this.views) for (const it of [...view.waiting, view.shown]) it?.bitmap.close();
    this.place.replaceChildren();
    this.views = scene.views.map((it, nth) => this.figure(it, nth));
    this.enlarge(null);
  }

  figure(it, nth) {
    const figure = document.createElement("figure");
    const canvas = document.createElement("canvas");
    const caption = document.createElement("figcaption");
    const [name, said] = [document.createElement("b"), document.createElement("span")];
    name.textContent = it.name;
    caption.append(name, said);
    figure.append(canvas, caption);
    this.place.append(figure);
    const [width, height] = it.size;
    canvas.width = 480;
    canvas.height = Math.round((480 * height) / Math.max(width, 1)) || 360;
    canvas.classList.toggle("tall", canvas.height > canvas.width);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `picture of ${it.name}`);
    canvas.onclick = (event) => this.click(nth, event);
    canvas.ondblclick = () => this.enlarge(nth);
    return { figure, canvas, said, pen: canvas.getContext("2d"), size: it.size, waiting: [], shown: null };
  }

  enlarge(nth) {
    this.large = nth === this.large || !this.views[nth] ? null : nth;
    this.place.classList.toggle("one", this.large !== null);
    this.views.forEach((it, k) => it.figure.classList.toggle("large", k === this.large));
  }

  // The views whose pictures are needed.
  wanted() {
    return this.on ? this.views.map((_, k) => k).filter((k) => this.large === null || k === this.large) : [];
  }

  click(nth, event) {
    const { canvas, size } = this.views[nth];
    const at = [(event.offsetX / canvas.clientWidth) * size[0], (event.offsetY / canvas.clientHeight) * size[1]];
    const joints = this.momentOf(nth)?.views[nth]?.joints || [];
    const far = joints.map((it) => it === null ? Infinity : Math.hypot(it[0] - at[0], it[1] - at[1]));
    const nearest = far.indexOf(Math.min(...far));
    const isNear = nearest >= 0 && far[nearest] < NEAR * size[0];
    this.point = isNear ? null : [nth, at];
    this.takeLines([]);
    this.marked(isNear ? nearest : null);
    this.askForLines();
  }

  takeLines(lines) {
    this.lines = lines;
    this.nLines++;
  }

  // Takes the requested lines.
  answer(lines) {
    this.asked = null;
    if (this.point || Number.isInteger(this.joint)) this.takeLines(lines);
    if (this.isChanged) this.askForLines();
  }

  // Requests the lines of a joint at its positions in all views, or of a point. Only one request is pending at a time, so
  // requests do not pile up on a slow machine. On a fast machine, lines come as often as results.
  askForLines() {
    const now = performance.now();
    this.isChanged = this.asked !== null && now - this.asked < PATIENCE_MS;
    if (this.isChanged) return;
    let points = [];
    if (this.point) points = [this.point];
    else if (this.joint !== null && this.joint !== undefined) {
      const at = (k) => this.momentOf(k)?.views[k]?.joints?.[this.joint];
      points = this.views.map((_, k) => [k, at(k)]).filter((it) => it[1]);
    }
    if (!points.length) {
      // Pictures are drawn again only if there were lines.
      if (this.lines.length) this.takeLines([]);
      return;
    }
    this.asked = this.ask({ epipolar: points }) ? now : null;
  }

  mark(joint) {
    this.joint = joint;
    if (joint !== null) this.point = null;
    if (joint === null && !this.point) this.takeLines([]);
    this.askForLines();
  }

  result(moment) {
    if (this.newest && moment.frame < this.newest.frame && this.isLive) this.moments.clear();
    this.newest = moment;
    this.moments.set(moment.frame, moment);
    while (this.moments.size > MOST_MOMENTS) this.moments.delete(this.moments.keys().next().value);
    if (!this.point) this.askForLines();
  }

  async take({ view, frame, isDrawn, jpeg }) {
    const it = this.views[view];
    if (!it || !this.on) return;
    const bitmap = await createImageBitmap(jpeg).catch(() => null);
    if (!bitmap) return;
    if (this.views[view] !== it) return bitmap.close();
    it.waiting.push({ frame, isDrawn, bitmap });
    if (it.waiting.length > MOST_WAITING) it.waiting.shift().bitmap.close();
    this.arrived?.();
  }

  // Returns the result to draw over the picture of a view: the result of its frame, or the last one before.
  momentOf(nth) {
    const shown = this.views[nth]?.shown;
    if (!shown || !this.isLive) return this.newest;
    if (this.moments.has(shown.frame)) return this.moments.get(shown.frame);
    let best = null;
    for (const it of this.moments.values()) if (it.frame <= shown.frame && (!best || it.frame > best.frame)) best = it;
    return best;
  }

  // Takes the newest picture whose frame has a result. If results are late or missing, takes the newest picture.
  choose(it) {
    const { waiting } = it;
    if (!waiting.length) return;
    const newest = this.newest?.frame ?? -1;
    let nth = waiting.length - 1;
    if (this.isLive) {
      const has = (k) => this.moments.has(waiting[k].frame);
      while (nth >= 0 && !(waiting[nth].frame <= newest && has(nth))) nth--;
      if (nth < 0) {
        const isFull = waiting.length >= MOST_WAITING - 1;
        if (!isFull && it.shown) return;
        nth = waiting.length - 1;
      }
    }
    const gone = waiting.splice(0, nth + 1);
    const chosen = gone.pop();
    for (const old of [...gone, it.shown]) old?.bitmap.close();
    it.shown = chosen;
  }

  draw() {
    this.views.forEach((it, nth) => {
      this.choose(it);
      const { canvas, pen, shown } = it;
      const ratio = (shown ? shown.bitmap.height / shown.bitmap.width : it.size[1] / Math.max(it.size[0], 1)) || 0.75;
      const width = Math.max(240, Math.min(960, Math.round((canvas.clientWidth || 480) * (window.devicePixelRatio || 1))));
      const height = Math.round(width * ratio);
      const moment = this.momentOf(nth);
      // Draws again only after a change.
      const state = [shown?.frame, moment?.frame, moment?.at, this.nLines, this.joint, this.point, this.poses, this.on, width, height].join();
      if (state === it.state) return;
      it.state = state;
      if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
      pen.clearRect(0, 0, width, height);
      if (shown && this.on) pen.drawImage(shown.bitmap, 0, 0, width, height);
      const scale = width / Math.max(it.size[0], 1);
      if (!(shown?.isDrawn && this.on)) this.drawPose(pen, moment, nth, scale, !shown || moment?.frame === shown.frame);
      this.drawLines(pen, nth, scale);
      this.tell(it, nth, moment);
    });
  }

  drawPose(pen, moment, nth, scale, isSame) {
    if (!moment || !this.poses) return;
    pen.globalAlpha = isSame || !this.isLive ? 1 : 0.45;
    pen.lineCap = "round";
    for (const it of moment.others) this.drawLimbs(pen, it.views[nth], scale, colourOf(it.id));
    const { joints } = moment.views[nth] ?? {};
    this.drawLimbs(pen, joints, scale);
    if (this.joint !== null && joints?.[this.joint]) this.ring(pen, joints[this.joint].map((v) => v * scale));
    pen.globalAlpha = 1;
  }

  drawLimbs(pen, joints, scale, colour) {
    if (!joints) return;
    for (const [from, to] of this.scene.limbs) {
      if (!joints[from] || !joints[to]) continue;
      pen.strokeStyle = colour || COLOURS[sideOf(this.scene.joints[from], this.scene.joints[to])];
      pen.lineWidth = Math.max(2, 0.006 * pen.canvas.width);
      pen.beginPath();
      pen.moveTo(...joints[from].map((v) => v * scale));
      pen.lineTo(...joints[to].map((v) => v * scale));
      pen.stroke();
    }
  }

  ring(pen, at) {
    pen.strokeStyle = COLOURS.accent;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(...at, 0.015 * pen.canvas.width + 3, 0, 2 * Math.PI);
    pen.stroke();
  }

  drawLines(pen, nth, scale) {
    if (this.point?.[0] === nth) this.ring(pen, this.point[1].map((v) => v * scale));
    pen.strokeStyle = COLOURS.accent;
    pen.lineWidth = 1.5;
    for (const [, to, curve] of this.lines) {
      if (to !== nth || curve.length < 2) continue;
      pen.beginPath();
      curve.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](x * scale, y * scale));
      pen.stroke();
    }
  }

  tell(it, nth, moment) {
    const seen = moment?.views[nth];
    const why = seen?.why;
    it.figure.classList.toggle("missing", Boolean(why));
    const frame = it.shown && this.on ? `frame ${it.shown.frame}` : this.on ? "no picture" : "";
    it.said.textContent = [why || (seen?.behind ? "from behind" : ""), frame].filter(Boolean).join(" · ");
  }
}
