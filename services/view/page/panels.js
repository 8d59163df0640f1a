// Numbers and texts: processes, events, and the facts at the top of the page.
const MOST_LINES = 200;

const digits = (value, n) => (Number.isFinite(value) ? value.toFixed(n) : "–");

function cells(row, kind, values) {
  for (const [text, name] of values) {
    const cell = document.createElement(kind);
    cell.textContent = text;
    if (name) cell.className = name;
    row.append(cell);
  }
}

// Returns the percentiles of a stage of a process; undefined if it was not measured.
function stage(process, ...names) {
  const times = process.measured?.times || [];
  return names.map((name) => times.find((it) => it.stage === name)).find(Boolean);
}

export function showProcesses(table, processes) {
  table.replaceChildren();
  cells(table.createTHead().insertRow(), "th", [["process"], ["state"], ["per second"], ["p50 ms"], ["p99 ms"], ["lost"], ["starts"], ["MB"]]);
  const body = table.createTBody();
  for (const it of processes) {
    const computing = stage(it, "computing");
    const lost = Object.values(it.measured?.dropped || {}).reduce((sum, n) => sum + n, 0);
    const view = it.measured?.view?.name;
    cells(body.insertRow(), "td", [
      [view ? `${it.process} ${view}` : it.process, "name"],
      [it.state, it.state],
      [digits(it.measured?.sent_per_second, 1)],
      [digits(computing?.p50_ms, 1)],
      [digits(computing?.p99_ms, 1)],
      [it.measured ? String(lost) : "–"],
      [it.measured ? String(1 + it.measured.restarts) : "–"],
      [digits(it.measured?.memory_bytes / 1e6, 0)],
    ]);
  }
}

// Shows rate and latency of the results, and the processes that are dead or silent.
export function showFacts(place, processes) {
  const last = processes.find((it) => it.process === "triangulate");
  const latency = last && stage(last, "end_to_end", "since_capture");
  const parts = [];
  const fact = (label, text) => {
    const value = document.createElement("b");
    value.textContent = text;
    parts.push(...(parts.length ? [" · "] : []), `${label} `, value);
  };
  if (last?.measured) fact("results per second", digits(last.measured.sent_per_second, 1));
  if (latency) fact("latency", `${digits(latency.p50_ms, 0)} ms, 99 % below ${digits(latency.p99_ms, 0)} ms`);
  const away = processes.filter((it) => ["dead", "silent"].includes(it.state)).map((it) => it.process);
  if (away.length) fact("missing:", away.join(", "));
  place.replaceChildren(...parts);
}

export function showEvent(list, event) {
  const line = document.createElement("li");
  const when = document.createElement("time");
  when.textContent = new Date(event.unix_ms).toLocaleTimeString([], { hour12: false });
  const what = document.createElement("span");
  what.textContent = event.what;
  what.className = event.weight;
  line.append(when, what);
  list.prepend(line);
  while (list.children.length > MOST_LINES) list.lastChild.remove();
}

// Draws the time line of a finished run, which shows the frames with skeletons.
export function showLine(canvas, line, colours) {
  const pen = canvas.getContext("2d");
  canvas.width = Math.max(line.length, 1);
  canvas.height = 1;
  [...line].forEach((piece, k) => {
    pen.fillStyle = { 1: colours.there, 0: colours.gone }[piece] || colours.some;
    pen.fillRect(k, 0, 1, 1);
  });
}
