// The page of `parallax view`: a running deployment, or a finished one with a time line.
import { Stage, colourOf } from "./stage.js";
import { Link } from "./link.js";
import { Pictures } from "./pictures.js";
import { showEvent, showFacts, showLine, showProcesses } from "./panels.js";

const element = (name) => document.getElementById(name);
const NOWHERE = { joints: [], limbs: [], views: [], eyes: [], up: [0, 0, 1] };
// Number of feet positions from which the floor is estimated, and speed at which the centre of the stage follows the person.
const MOST_FEET = 400;
const PULL = 0.06;

let hello = null;
let scene = NOWHERE;
let moment = null;
// True while a live run is shown as it arrives, or a finished run is played.
let playing = true;
let dirty = true;
let feet = [];
let floor = null;
// Frame of a finished run that was requested and has not arrived yet.
let asked = null;
// Identity of the person who is shown in full; null for the followed person.
let chosen = null;
// Frame of a finished run to request next.
let next = null;
let clock = null;
let drawn = 0;
// Counts for tests.
const counts = { moments: 0, pictures: 0, lines: 0, hellos: 0, opened: 0 };

const redraw = () => { dirty = true; };
const stage = new Stage(element("space"), NOWHERE, redraw);
const pictures = new Pictures(element("cameras"), (it) => link.ask(it), (joint) => choosePart(joint));
pictures.arrived = () => {
  counts.pictures++;
  redraw();
};
const link = new Link({ state: showLink, text: take, picture: (it) => { if (playing || hello?.mode === "finished") pictures.take(it); }, open: () => { counts.opened++; asked = null; } });

function showLink(word, kind) {
  element("link").textContent = word;
  element("link").className = `pill ${kind}`;
}

function take(value) {
  const known = {
    hello: begin, state: showState, moment: arrive, event: (it) => showEvent(element("events"), it),
    epipolar: (it) => { counts.lines++; pictures.answer(it.lines); redraw(); },
    unread: (it) => { asked = null; say(`frame ${it.at} cannot be read: ${it.why}`); },
    refused: (it) => console.warn(it.why),
  };
  known[value.type]?.(value);
}

function begin(value) {
  const isSame = hello && JSON.stringify(value.scene) === JSON.stringify(hello.scene) && value.mode === hello.mode;
  counts.hellos++;
  hello = value;
  const isFinished = value.mode === "finished";
  const name = value.scene?.name || value.name;
  element("title").textContent = name || "Parallax";
  element("title").title = value.name || "";
  document.title = name ? `${name} – Parallax` : "Parallax";
  if (value.mode === "waiting") {
    showLink("waiting", "");
    empty(value.why);
    element("record").hidden = true;
    return;
  }
  showLink({ live: "live", finished: "finished run" }[value.mode], "live");
  empty("");
  element("record").hidden = !value.can_record;
  const notes = [...(value.notes || []), value.scene.problem && !value.notes ? value.scene.problem : ""].filter(Boolean);
  element("notes").textContent = notes.join(" · ");
  element("notes").hidden = !notes.length;
  for (const name of ["state", "happened"]) element(name).hidden = isFinished;
  element("time").hidden = !isFinished;
  if (!isSame) show(value);
  // Pictures come with the frames that are requested after this.
  askForPictures();
  if (isFinished) beginFinished(value, isSame);
  redraw();
}

function show(value) {
  [moment, chosen] = [null, null];
  [feet, floor, clock] = [[], null, null];
  scene = { ...value.scene, eyes: value.scene.views.filter((it) => it.at) };
  stage.show(scene);
  const at = scene.eyes.map((it) => stage.along(it.at));
  const mean = (k) => (at.length ? at.reduce((sum, it) => sum + it[k], 0) / at.length : 0);
  // Until a person is seen, the centre is between the cameras, at the height of a person.
  stage.middle = stage.place(mean(0), mean(1), at.length ? Math.min(...at.map((it) => it[2])) - 0.6 : 0.9);
  const reach = at.map((it) => Math.hypot(it[0] - mean(0), it[1] - mean(1)));
  stage.view.far = Math.min(14, Math.max(5, 1.45 * Math.max(0, ...reach)));
  pictures.show(scene, value.mode === "live");
  const part = element("part");
  part.replaceChildren(part.options[0], ...scene.joints.map((name, k) => new Option(name, k)));
  choosePart(null);
  if (value.mode === "live") hold(false);
}

function beginFinished(value, isSame) {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  showLine(element("line"), value.line, { there: colour("--there"), gone: colour("--gone"), some: colour("--none") });
  element("at").max = Math.max(value.n - 1, 0);
  if (!isSame) hold(true);
  go(isSame && moment ? moment.at : 0);
}

// Exchanges the chosen person with the followed person, if the chosen person is in the frame.
function choose(value) {
  const nth = value.others.findIndex((it) => it.id === chosen);
  if (nth < 0) return;
  const [other] = value.others.splice(nth, 1);
  const followed = { id: value.id, joints: value.joints, stature: value.stature, views: value.views.map((it) => it.joints) };
  if (followed.id !== null) value.others.push(followed);
  Object.assign(value, { id: other.id, joints: other.joints, stature: other.stature, spread: [] });
  value.views.forEach((it, k) => { it.joints = other.views[k] ?? null; it.behind = false; });
}

// Lists the people to choose from. The chosen person stays in the list while no view sees them.
function name(value) {
  const ids = [value.id, ...value.others.map((it) => it.id), chosen].filter((id) => id !== null);
  const all = [...new Set(ids)].sort((a, b) => a - b);
  element("whom").hidden = all.length < 2;
  const who = element("who");
  const known = [...who.options].slice(1).map((it) => Number(it.value));
  if (known.join() !== all.join()) {
    who.replaceChildren(who.options[0], ...all.map((id) => new Option(String(id), id)));
    who.value = chosen === null ? "" : String(chosen);
  }
}

function arrive(value) {
  counts.moments++;
  name(value);
  choose(value);
  if (hello?.mode === "finished") {
    asked = null;
    element("at").value = next ?? value.at;
  } else if (!playing) return;
  moment = value;
  follow(value);
  pictures.result(value);
  if (next !== null) go(next);
  redraw();
}

// The stage follows the person slowly. Its floor is at the lowest positions of the feet.
function follow(value) {
  const points = value.joints.filter(Boolean).map((it) => stage.along(it));
  if (!points.length) return;
  feet.push(Math.min(...points.map((it) => it[2])));
  if (feet.length > MOST_FEET) feet.shift();
  floor = [...feet].sort((a, b) => a - b)[Math.floor(0.1 * feet.length)];
  const mean = (k) => points.reduce((sum, it) => sum + it[k], 0) / points.length;
  const now = stage.along(stage.middle);
  const pull = feet.length < 3 ? 1 : PULL;
  const to = [mean(0), mean(1), floor + 0.9].map((it, k) => now[k] + pull * (it - now[k]));
  stage.middle = stage.place(...to);
}

function showState(value) {
  showProcesses(element("processes"), value.processes);
  showFacts(element("facts"), value.processes);
  const button = element("record");
  button.setAttribute("aria-pressed", String(Boolean(value.recording)));
  button.textContent = value.recording ? `recording ${value.recording.seconds} s, ${(value.recording.bytes / 1e6).toFixed(0)} MB` : "record";
  button.title = value.recording?.file || "record the run (R)";
}

function empty(why) {
  element("empty").hidden = !why;
  element("empty").textContent = why ? `${why} – this page will continue automatically` : "";
}

function say(text) {
  element("said").textContent = text;
}

function draw() {
  dirty = false;
  stage.clear();
  const eyes = scene.views.map((it, k) => [it, k]).filter(([it]) => it.at);
  stage.drawStage(eyes.map(([, k]) => Boolean(moment?.views[k]?.why)));
  if (moment) {
    if (element("spread").checked) {
      moment.spread.forEach((it, k) => {
        if (it && moment.joints[k]) stage.drawSpread(moment.joints[k], it, "#c6d0de");
      });
    }
    for (const it of moment.others) {
      stage.drawSkeleton(it.joints, 3, colourOf(it.id));
      stage.drawName(it.joints, it.id, colourOf(it.id));
    }
    stage.drawSkeleton(moment.joints, 4);
    if (moment.others.length) stage.drawName(moment.joints, moment.id, "#e6ebf2");
    const words = [`frame ${moment.frame}`, moment.seconds !== null && `${moment.seconds.toFixed(2)} s`, moment.why,
      moment.people > 1 && `${moment.people} people`, moment.stature && `${moment.stature.toFixed(2)} m tall`];
    say(words.filter(Boolean).join(", "));
  }
  pictures.draw();
  document.documentElement.dataset.counts = JSON.stringify({ ...counts, frame: moment?.frame ?? null, joints: moment?.joints ?? [] });
}

function turn(now) {
  if (hello?.mode === "finished" && playing && moment) play(now / 1000);
  // Thirty times a second is enough, and leaves time for messages.
  if (dirty && now - drawn > 30) {
    drawn = now;
    draw();
  }
  requestAnimationFrame(turn);
}

// Plays a finished run at its original speed: requests the frame that is due.
function play(seconds) {
  if (moment.at >= hello.n - 1) return hold(true);
  const rate = scene.rate || 10;
  const step = hello.n > 1 ? (hello.last - hello.first) / (hello.n - 1) : 1;
  clock ??= { at: moment.at, seconds };
  const due = clock.at + Math.floor(((seconds - clock.seconds) * rate) / Math.max(step, 1e-9));
  if (due > moment.at && asked === null) go(Math.min(due, hello.n - 1));
}

// Requests a frame of a finished run. While a request is pending, only the last further one is remembered.
function go(at) {
  if (hello?.mode !== "finished") return;
  at = Math.min(Math.max(0, at), hello.n - 1);
  element("at").value = at;
  if (asked !== null) {
    next = at;
    return;
  }
  next = null;
  if (link.ask({ at })) asked = at;
}

function hold(on) {
  playing = !on;
  clock = null;
  element("play").textContent = on ? "play" : "pause";
  redraw();
}

function step(by) {
  hold(true);
  go((next ?? asked ?? moment?.at ?? 0) + by);
}

function askForPictures() {
  pictures.on = element("shots").checked;
  link.ask({ pictures: pictures.wanted() });
  if (hello?.mode === "finished" && moment) go(moment.at);
  redraw();
}

function choosePart(joint) {
  element("part").value = joint === null ? "" : String(joint);
  pictures.mark(joint);
  redraw();
}

function playOrHold() {
  if (hello?.mode === "finished" && !playing && moment?.at >= hello.n - 1) go(0);
  hold(playing);
}

function record() {
  const is = element("record").getAttribute("aria-pressed") === "true";
  if (!element("record").hidden) link.ask({ record: !is });
}

function enlarge(nth) {
  pictures.enlarge(nth);
  askForPictures();
}

function flip(name) {
  element(name).checked = !element(name).checked;
  element(name).onchange();
}

element("play").onclick = playOrHold;
element("record").onclick = record;
element("help").onclick = () => element("keys").showModal();
element("spread").onchange = redraw;
element("poses").onchange = () => { pictures.poses = element("poses").checked; redraw(); };
element("shots").onchange = askForPictures;
element("part").onchange = () => choosePart(element("part").value === "" ? null : Number(element("part").value));
element("who").onchange = () => choosePerson(element("who").value === "" ? null : Number(element("who").value));
element("at").oninput = () => { hold(true); go(Number(element("at").value)); };
window.addEventListener("resize", redraw);

const keys = {
  " ": playOrHold, ",": () => step(-1), ".": () => step(1), Home: () => step(-Infinity), End: () => step(Infinity),
  "+": () => stage.near(0.9), "=": () => stage.near(0.9), "-": () => stage.near(1.1),
  n: nextPerson, u: () => flip("spread"), o: () => flip("poses"), p: () => flip("shots"), r: record,
  "?": () => element("keys").showModal(),
  "[": () => nextPart(-1), "]": () => nextPart(1),
  Escape: () => { pictures.point = null; choosePart(null); if (pictures.large !== null) enlarge(null); },
};

// The drawing stays until the next frame arrives. For a finished run, the same frame is requested again.
function choosePerson(id) {
  chosen = id;
  element("who").value = id === null ? "" : String(id);
  if (hello?.mode === "finished" && moment) go(moment.at);
}

function nextPerson() {
  const all = [...element("who").options].map((it) => it.value);
  const at = all.indexOf(element("who").value);
  const then = all[(at + 1) % all.length];
  choosePerson(then === "" ? null : Number(then));
}

function nextPart(by) {
  const n = scene.joints.length + 1;
  const now = pictures.joint ?? -1;
  const then = (((now + 1 + by) % n) + n) % n;
  choosePart(then === 0 ? null : then - 1);
}

document.addEventListener("keydown", (event) => {
  const isTyped = event.target.matches("select, input[type=text], dialog *");
  if (isTyped || event.ctrlKey || event.metaKey || event.altKey) return;
  const turned = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.08], ArrowDown: [0, 0.08] }[event.key];
  if (turned && event.target === element("space")) {
    event.preventDefault();
    return stage.turn(...turned);
  }
  // Buttons and checkboxes handle the space key themselves.
  if (event.key === " " && event.target.matches("button, input")) return;
  if (/^[1-9]$/.test(event.key)) return enlarge(Number(event.key) - 1);
  const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!act || (event.target.matches("input[type=range]") && ["Home", "End"].includes(event.key))) return;
  event.preventDefault();
  act();
});

stage.fit();
new ResizeObserver(() => stage.fit()).observe(element("space"));
requestAnimationFrame(turn);
