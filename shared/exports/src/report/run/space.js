// Plays a run on a stage (stage.js stands before this).
const data = JSON.parse(document.getElementById("data").textContent);
const element = (name) => document.getElementById(name);
const metres = (mm) => mm && mm.map((it) => it / 1000);
const moments = data.moments.map((it) => ({ ...it, found: it.found.map(metres), truth: it.truth.map(metres) }));
const eyes = data.eyes.map((it) => ({ ...it, at: metres(it.at) }));
const stage = new Stage(element("space"), { ...data, eyes }, draw);
const points = moments.flatMap((it) => it.truth.concat(it.found.filter(Boolean))).map((it) => stage.along(it));
const among = (axis, share) => {
  const sorted = points.map((it) => it[axis]).sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor(share * (sorted.length - 1))] : 0;
};
stage.middle = stage.place(among(0, 0.5), among(1, 0.5), among(2, 0.01) + 0.9);

let nth = 0;
let playing = true;

function draw() {
  const moment = moments[nth];
  stage.clear();
  if (!moment) return;
  stage.drawStage(moment.views.map((it) => it !== null));
  if (element("truth").checked && moment.truth.length) stage.drawSkeleton(moment.truth, 2, COLOURS.truth);
  stage.drawSkeleton(moment.found, 4);
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
stage.fit();
requestAnimationFrame(turn);
