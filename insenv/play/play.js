"use strict";
// One run on one page: events come down a stream, what is asked for goes up. Angles are counter-clockwise, in rad.
const $ = id => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const token = new URLSearchParams(location.search).get("token") || "";
const ask = (what, value) => fetch("/", {
  method: "POST", headers: {"X-Token": token}, body: JSON.stringify({what, value}),
}).catch(() => {});

let run = null, frames = [], bounds = [], drives = "", dirty = false, moved = {from: 0, to: 0, at: 0, span: 1};
// The quantity that is drawn; when a frame was heard last [ms], and whether a long wait was spoken of.
let chosen = 0, heard = 0, waiting = false;
const painted = {count: 0};
window.insenvPlay = {painted, get frames() { return frames; }, get run() { return run; }};

// ---------------------------------------------------------------------------------------------- small helpers

function made(name, attributes = {}, text = "") {
  const one = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, value);
  one.textContent = text;
  return one;
}

function drawn(name, attributes, text) {
  const one = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, value);
  if (text !== undefined) one.textContent = text;
  return one;
}

const raised = power => [...String(power)].map(c => c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]).join("");

function number(value, digits = 3) {
  if (value === null || !isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e6 || (size > 0 && size < 1e-4)) {
    const [head, power] = value.toExponential(digits - 1).split("e");
    return `${Number(head)}·10${raised(Number(power))}`.replace("-", "−");
  }
  return value.toLocaleString("en", {maximumSignificantDigits: digits, useGrouping: size >= 10000}).replaceAll("-", "−");
}

// Names of the code as words: "accel_x.accel_bias.c" is "accel x: bias", "gyro_x.g_sensitivity.c_y" ends in "y".
const plainly = name => name.replace(".accel_", ".").replace(/\.c(_|$)/, ".$1").replaceAll("_", " ").replace(".", ": ").replaceAll(".", "");

// So many quantities are shown in words; more are a table.
const FEW = 3;

// Whether a frame's belief of quantity j is more than what was known before.
const known = (frame, j) => frame.sd[j] !== null && frame.sd[j] < 0.97 * run.quantities[j].prior;

// A value of a quantity in its unit; what is large in seconds of arc is read in degrees.
function shown(value, quantity) {
  if (value === null) return "–";
  const own = value / quantity.scale;
  return quantity.unit === "arcsec" && Math.abs(own) >= 3600
    ? `${number(own / 3600)} deg` : `${number(own)} ${quantity.unit}`;
}

const error = (mean, truth, circular) =>
  mean === null || truth === null ? null
    : circular ? ((mean - truth + Math.PI) % (2 * Math.PI) + 2 * Math.PI) % (2 * Math.PI) - Math.PI : mean - truth;

// The largest of 1, 2, 5 times a power of ten that is not larger.
function round(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [5, 2, 1].find(k => k * power <= size * 1.000001) * power;
}

// ---------------------------------------------------------------------------------------------------- the dial

const place = (angle, radius) => `${(-radius * Math.sin(angle)).toFixed(3)} ${(-radius * Math.cos(angle)).toFixed(3)}`;

function sector(angle, half, inner, outer) {
  const h = Math.min(Math.max(half, 0.008), Math.PI * 0.9999), a = angle - h, b = angle + h, large = h > Math.PI / 2 ? 1 : 0;
  return `M${place(a, outer)}A${outer} ${outer} 0 ${large} 0 ${place(b, outer)}L${place(b, inner)}A${inner} ${inner} 0 ${large} 1 ${place(a, inner)}Z`;
}

function begunDial() {
  $("zero").textContent = run.zero ? `top: ${run.zero}` : "";
  $("ticks").setAttribute("d", Array.from({length: 72}, (_, k) =>
    `M${place(k * Math.PI / 36, 92)}L${place(k * Math.PI / 36, k % 6 ? 95 : 99)}`).join(""));
  for (const id of ["body", "ghost", "fixed"]) $(id).replaceChildren();
  // What a package brings as a picture is parsed as SVG alone.
  const parsed = new DOMParser().parseFromString(`<svg xmlns="${SVG}">${run.body}</svg>`, "image/svg+xml").documentElement;
  for (const id of ["body", "ghost"]) $(id).append(...Array.from(parsed.cloneNode(true).childNodes));
  run.pointers.forEach((pointer, k) => {
    const layer = pointer.carried ? $("body") : $("fixed");
    layer.append(
      drawn("path", {id: `sector-${k}`, class: "belief"}), drawn("path", {id: `mean-${k}`, class: "mean"}),
      drawn("path", {id: `true-${k}`, class: "true"}));
    $("fixed").append(drawn("text", {id: `name-${k}`, class: "name"}, pointer.name));
  });
}

function drawnDial(frame, angle) {
  $("body").toggleAttribute("hidden", frame.angle === null);
  $("body").setAttribute("transform", `rotate(${-angle * 180 / Math.PI})`);
  run.pointers.forEach((pointer, k) => {
    const j = run.quantities.findIndex(q => q.name === pointer.quantity);
    if (j < 0) return;
    const some = known(frame, j);
    const at = pointer.sense * frame.mean[j], truth = pointer.sense * frame.true[j];
    $(`sector-${k}`).setAttribute("d", some ? sector(at, frame.sd[j], 76, 90) : sector(0, Math.PI, 76, 90));
    $(`sector-${k}`).classList.toggle("nothing", !some);
    $(`mean-${k}`).setAttribute("d", some ? `M${place(at, 74)}L${place(at, 91)}` : "");
    const seen = $("truth").checked && frame.true[j] !== null;
    $(`true-${k}`).setAttribute("d", seen ? `M${place(truth, 92)}L${place(truth, 104)}` : "");
    const name = $(`name-${k}`), [x, y] = place((seen ? truth : at) + (pointer.carried ? angle : 0), 113).split(" ");
    name.setAttribute("x", Math.max(-122, Math.min(122, x))); name.setAttribute("y", y);
    name.setAttribute("text-anchor", x < -90 ? "start" : x > 90 ? "end" : "middle");
    name.toggleAttribute("hidden", !seen && !some);
  });
}

// -------------------------------------------------------------------------------------------------- the charts

function ticks(low, high, log) {
  if (!log) {
    const step = round((high - low) / 2.4), first = Math.ceil(low / step - 1e-9);
    return Array.from({length: Math.floor(high / step + 1e-9) - first + 1}, (_, k) => (first + k) * step);
  }
  const found = [], decades = Math.log10(high / low);
  for (let p = Math.floor(Math.log10(low)); p <= Math.log10(high); p++)
    for (const k of decades > 2.5 ? [1] : decades > 1 ? [1, 3] : [1, 2, 5])
      if (k * 10 ** p >= low && k * 10 ** p <= high) found.push(k * 10 ** p);
  return found.length > 6 ? found.filter((_, k) => k % 2 === 0) : found;
}

// All numbers of an axis, written one way; what they are to be taken times stands beside its title once.
function axis(values, log) {
  const sizes = values.map(Math.abs).filter(v => v > 0), most = Math.max(...sizes), least = Math.min(...sizes);
  if (!sizes.length || (most < 1e5 && (log ? least : most) >= 1e-3)) return {texts: values.map(v => number(v)), times: ""};
  const power = v => Math.floor(Math.log10(v) + 1e-9);
  if (log) return {times: "", texts: values.map(v => {
    const head = Math.round(v / 10 ** power(v));
    return `${head === 1 ? "" : `${head}·`}10${raised(power(v))}`;
  })};
  const shared = 3 * Math.floor(power(most) / 3);
  return {texts: values.map(v => number(v / 10 ** shared)), times: ` × 10${raised(shared)}`};
}

function thinned(points, most = 700) {
  const every = Math.ceil(points.length / most);
  return every < 2 ? points : points.filter((_, k) => k % every === 0 || k === points.length - 1);
}

// Curves {points: [[t, y]], kind, stairs} against the time of the run.
function chart(svg, curves, label, log) {
  const width = svg.clientWidth, height = svg.clientHeight;
  if (!width || !height) return;
  const values = curves.flatMap(c => c.points.map(p => p[1])).filter(v => isFinite(v) && (!log || v > 0));
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  let [low, high] = values.length ? [Math.min(...values), Math.max(...values)] : [log ? 1 : 0, log ? 10 : 1];
  if (log) [low, high] = [low / 1.4, high * 1.4];
  else { const room = 0.08 * (high - low) || Math.abs(high) * 0.1 || 1; [low, high] = [low - room, high + room]; }
  const of = log ? Math.log : v => v, marks = ticks(low, high, log), {texts, times} = axis(marks, log);
  // Below its title by a line, and as far from the edge as its longest number asks.
  const parts = [], left = 12 + 6.5 * Math.max(4, ...texts.map(text => text.length));
  const right = width - 8, top = 26, bottom = height - 20;
  const x = t => left + (right - left) * t / run.duration;
  const y = v => bottom - (bottom - top) * (of(v) - of(low)) / (of(high) - of(low));
  marks.forEach((v, k) => {
    parts.push(drawn("path", {d: `M${left} ${y(v)}H${right}`, class: "grid"}));
    parts.push(drawn("text", {x: left - 5, y: y(v) + 4, "text-anchor": "end"}, texts[k]));
  });
  const last = ticks(0, run.duration, false);
  for (const t of last) parts.push(drawn("text", {x: Math.min(x(t), right - 10), y: height - 5, "text-anchor": "middle"}, number(t, 4)));
  parts.push(drawn("text", {x: 2, y: 11}, label + times));
  parts.push(drawn("text", {x: right, y: 11, "text-anchor": "end"}, "against time [s]"));
  for (const curve of curves) {
    const good = thinned(curve.points).filter(p => isFinite(p[1]) && (!log || p[1] > 0));
    if (!good.length) continue;
    const line = good.map((p, k) => k === 0 ? `M${x(p[0]).toFixed(1)} ${y(p[1]).toFixed(1)}`
      : curve.stairs ? `V${y(p[1]).toFixed(1)}H${x(p[0]).toFixed(1)}` : `L${x(p[0]).toFixed(1)} ${y(p[1]).toFixed(1)}`);
    parts.push(drawn("path", {d: line.join(""), class: `curve ${curve.kind}`}));
    const end = good[good.length - 1];
    if (curve.kind !== "demanded") parts.push(drawn("circle", {cx: x(end[0]), cy: y(end[1]), r: 3, class: `dot ${curve.kind}`}));
  }
  svg.replaceChildren(...parts);
}

// The belief as a normal density about the truth, or about itself where that is hidden.
function closeUp(frame) {
  const svg = $("close-up"), j = chosen, q = run.quantities[j], width = svg.clientWidth, height = svg.clientHeight;
  if (!width || !q) return;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const seen = $("truth").checked && frame.true[j] !== null, some = known(frame, j);
  const e = seen ? error(frame.mean[j], frame.true[j], q.circular) : 0, sd = frame.sd[j];
  const reach = some ? q.scale / round(q.scale / Math.max(3.5 * sd, 1.25 * Math.abs(e))) : 3 * q.prior;
  const x = v => width / 2 + v / reach * (width / 2 - 24), bottom = height - 32, parts = [];
  const y = v => bottom - (bottom - 8) * v;
  parts.push(drawn("path", {d: `M24 ${bottom}H${width - 24}`, class: "grid"}));
  if (some) {
    const bell = Array.from({length: 121}, (_, k) => -4 + k / 15);
    const line = bell.map(z => [x(e + z * sd), y(Math.exp(-z * z / 2))]).filter(p => p[0] >= 12 && p[0] <= width - 12);
    if (line.length) parts.push(drawn("path", {class: "belief", d: `M${line[0][0]} ${bottom}L${line.map(p => p.join(" ")).join("L")}L${line[line.length - 1][0]} ${bottom}Z`}));
  } else parts.push(drawn("rect", {x: 24, y: y(0.35), width: width - 48, height: bottom - y(0.35), class: "belief nothing"}));
  if (seen) parts.push(drawn("path", {d: `M${x(0)} ${bottom}V4`, class: "true"}));
  for (const v of [-1, -0.5, 0, 0.5, 1]) parts.push(drawn("text", {x: x(v * reach), y: bottom + 13, "text-anchor": "middle"}, number(v * reach / q.scale)));
  const about = seen ? "less the truth" : "less what is believed";
  parts.push(drawn("text", {x: width / 2, y: height - 4, "text-anchor": "middle"}, `${plainly(q.name)} ${about} [${q.unit}]`));
  svg.replaceChildren(...parts);
}

function drawnCharts() {
  const j = chosen, q = run.quantities[j], truth = $("truth").checked;
  if (q) {
    const curves = [{points: [[0, q.demanded / q.scale], [run.duration, q.demanded / q.scale]], kind: "demanded"}];
    // An error that passes through zero would stretch the axis to nothing: it is drawn down to a tenth of what is claimed.
    if (truth) curves.push({kind: "error", points: frames.map(f => {
      const e = error(f.mean[j], f.true[j], q.circular);
      return [f.t, !known(f, j) || e === null ? NaN : Math.max(Math.abs(e), f.sd[j] / 10) / q.scale];
    })});
    curves.push({kind: "bound", points: bounds.filter(b => b[1][j] !== null && b[1][j] < q.prior).map(b => [b[0], b[1][j] / q.scale])});
    curves.push({kind: "claimed", points: frames.map(f => [f.t, f.sd[j] === null ? NaN : f.sd[j] / q.scale])});
    chart($("worth"), curves, `${plainly(q.name)} [${q.unit}]`, true);
  }
  const c = run.controls[0];
  chart($("commands"), [{kind: "claimed", stairs: true, points: frames.map(f => [f.t, f.given[0] / c.scale])}],
    `${c.name}${c.unit ? ` [${c.unit}]` : ""}`, false);
}

// ---------------------------------------------------------------------------------------------------- in words

let tabled = 0;
function drawnWords(frame) {
  $("time").textContent = `${number(frame.t, 4)} s of ${number(run.duration, 4)} s`;
  $("progress").value = frame.t / run.duration;
  if (run.quantities.length > FEW) {
    // A table of fifty rows is laid out anew a few times a second, and not with every step.
    if (performance.now() - tabled > 300 || frame.over || run.paused) { drawnTable(frame); tabled = performance.now(); }
  } else run.quantities.forEach((q, j) => {
    const some = known(frame, j), e = error(frame.mean[j], frame.true[j], q.circular);
    $(`claimed-${j}`).textContent = some ? `± ${shown(frame.sd[j], q)}` : "nothing known yet";
    $(`error-${j}`).textContent = !$("truth").checked ? "hidden"
      : some && e !== null ? `${shown(e, q)} (${number(e / frame.sd[j], 2)} of its deviation)` : "–";
    const own = least(j);
    const at = bounds.length ? bounds[bounds.length - 1][0] : 0;
    $(`bound-${j}`).textContent = own === null || own >= q.prior ? "–"
      : shown(own, q) + (frame.t - at > 0.05 * run.duration ? ` (at ${number(at, 4)} s)` : "");
  });
  const rows = frame.readings.filter(reading => reading[1] !== null).map(([name, value, unit]) => {
    const row = made("tr");
    row.append(made("td", {}, name), made("td", {class: "n"}, number(value, 5)), made("td", {}, unit));
    return row;
  });
  $("readings").replaceChildren(...rows);
}

// Of many quantities a row each, in its unit; an error is read best in deviations.
function drawnTable(frame) {
  let reached = 0;
  run.quantities.forEach((q, j) => {
    const some = known(frame, j), e = error(frame.mean[j], frame.true[j], q.circular), own = least(j);
    const enough = some && frame.sd[j] <= q.demanded * 1.000001;
    reached += enough;
    $(`row-${j}`).classList.toggle("enough", enough);
    $(`claimed-${j}`).textContent = some ? number(frame.sd[j] / q.scale) : "not yet";
    $(`error-${j}`).textContent = !$("truth").checked ? "hidden" : some && e !== null ? number(e / frame.sd[j], 2) : "–";
    $(`bound-${j}`).textContent = own === null || own >= q.prior ? "–" : number(own / q.scale);
  });
  $("reached").textContent = `${reached} of ${run.quantities.length} as well known as demanded`;
}

// The bound of quantity j as it was computed last.
const least = j => bounds.length ? bounds[bounds.length - 1][1][j] : null;

function tell(text, bad = true) {
  $("note").hidden = !text;
  $("note").textContent = text;
  $("note").classList.toggle("caution", bad);
}

function ended(frame) {
  const j = chosen, q = run.quantities[j];
  const words = [frame.t >= run.duration - 1e-6 ? "Time is up." : `The run was ended at ${number(frame.t, 4)} s.`];
  if (q && frame.sd[j] !== null && frame.true[j] !== null) {
    words.push(`Claimed: ${plainly(q.name)} ± ${shown(frame.sd[j], q)}; error ${shown(error(frame.mean[j], frame.true[j], q.circular), q)};`);
    words.push(`demanded ${shown(q.demanded, q)}.`);
    if (least(j) !== null) words.push(`The least deviation for this motion (Cramér-Rao) is ${shown(least(j), q)}.`);
  }
  words.push(`Score: ${number(frame.score)}.`);
  tell(words.join(" "), false);
}

// ------------------------------------------------------------------------------------------------- the controls

const step = c => round((c.high - c.low) / c.scale / 50);

function set(k, value, tellIt = true) {
  const c = run.controls[k];
  const to = Math.min(Math.max(value, c.low / c.scale), c.high / c.scale);
  $(`range-${k}`).value = to; $(`box-${k}`).value = +to.toPrecision(6);
  if (tellIt && c.held) ask("control", [k, to * c.scale]);
}

const give = k => ask("control", [k, Number($(`box-${k}`).value) * run.controls[k].scale]);

function begunControls() {
  $("controls").replaceChildren(...run.controls.map((c, k) => {
    const row = made("div", {class: "control"});
    const low = c.low / c.scale, high = c.high / c.scale;
    const range = made("input", {type: "range", id: `range-${k}`, min: low, max: high, step: step(c) / 10});
    const box = made("input", {type: "number", id: `box-${k}`, min: low, max: high, step: "any", "aria-label": `${c.name}, ${c.unit}`});
    row.append(made("label", {for: `range-${k}`}, c.name), box, made("span", {class: "unit"}, c.unit), range);
    range.addEventListener("input", () => set(k, Number(range.value)));
    box.addEventListener("change", () => set(k, Number(box.value)));
    if (!c.held) {
      const button = made("button", {type: "button"}, `${c.verb} `);
      button.append(made("kbd", {}, "enter"));
      button.addEventListener("click", () => give(k));
      row.append(button);
    } else if (low < 0) {
      const button = made("button", {type: "button"}, "zero ");
      if (k === 0) button.append(made("kbd", {}, "0"));
      button.addEventListener("click", () => set(k, 0));
      row.append(button);
    }
    return row;
  }));
  run.controls.forEach((c, k) => set(k, c.held ? 0 : Math.min(90, c.high / c.scale), false));
  $("signals").replaceChildren(...run.signals.map((s, k) => {
    const button = made("button", {type: "button"}, `${s.name[0].toUpperCase()}${s.name.slice(1)} `);
    button.append(made("kbd", {}, s.key));
    button.addEventListener("click", () => ask("signal", k));
    return button;
  }));
  $("signal-keys").textContent = run.signals.map(s => `${s.key}: ${s.name}`).join("; ");
  $("signal-keys").hidden = !run.signals.length;
}

function begunMenus() {
  const speeds = [1, 2, 5, 10, 20, 50, 100, 200];
  if (!speeds.includes(run.speed)) speeds.push(run.speed);
  $("speed").replaceChildren(...speeds.map(s => made("option", {value: s}, s === 1 ? "real time" : `${s} times`)));
  $("speed").value = run.speed;
  $("driver").replaceChildren(made("option", {value: ""}, "you"), ...run.policies.map(p => made("option", {value: p}, p)));
  $("seed").value = run.seed;
}

// A quantity to draw, and all of them in a table.
function begunTable() {
  const rows = run.quantities.map((q, j) => {
    const row = made("tr", {id: `row-${j}`});
    row.append(
      made("td", {}, `${plainly(q.name)}${q.unit ? ` [${q.unit}]` : ""}`),
      ...["claimed", "error", "bound"].map(id => made("td", {id: `${id}-${j}`, class: "n"}, "–")),
      made("td", {class: "n"}, number(q.demanded / q.scale)));
    return row;
  });
  const head = made("tr"), label = made("label", {for: "chosen"}, "drawn: ");
  head.append(...["sought", "claimed ±", "error / claimed", "bound", "demanded"].map((text, k) => made("th", k ? {class: "n"} : {}, text)));
  const table = made("table"), top = made("thead"), body = made("tbody"), select = made("select", {id: "chosen"});
  top.append(head); body.append(...rows); table.append(top, body);
  select.append(...run.quantities.map((q, j) => made("option", {value: j}, plainly(q.name))));
  select.value = chosen;
  select.addEventListener("change", () => { chosen = Number(select.value); dirty = true; charted = 0; });
  const line = made("p", {class: "row"}), scroll = made("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": "what is sought"});
  line.append(label, select);
  scroll.append(table);
  $("quantities").replaceChildren(made("p", {id: "reached", class: "reached"}), line);
  $("every").replaceChildren(made("h3", {}, "All that is sought"), scroll);
}

function begunQuantities() {
  chosen = Math.min(chosen, Math.max(run.quantities.length - 1, 0));
  $("every").replaceChildren();
  const key = (kind, text) => { const one = made("span", {class: `key ${kind}`}, text); return one; };
  if (run.quantities.length > FEW) begunTable();
  else $("quantities").replaceChildren(...run.quantities.map((q, j) => {
    const list = made("dl", {class: "worth"});
    for (const [id, text] of [["claimed", plainly(q.name)], ["error", "error"], ["bound", "bound"], ["demanded", "demanded"]]) {
      const value = made("dd", {id: `${id}-${j}`}, id === "demanded" ? shown(q.demanded, q) : "–");
      list.append(made("dt", {}, text), value);
    }
    return list;
  }));
  $("worth-legend").replaceChildren(
    key("claimed", "claimed standard deviation"), " ", key("error", "error, which no estimator knows"), " ",
    key("bound", "least deviation for this motion (Cramér-Rao)"), " ", key("demanded", "demanded"),
    " Good: the claimed deviation runs along its bound, and the error stays below twice of it.");
}

function driven(name) {
  drives = name;
  if (name && !run.policies.includes(name)) $("driver").append(made("option", {value: name}, name));
  $("driver").value = name;
}

function paused(now) {
  run.paused = now;
  heard = performance.now();
  $("pause").firstChild.textContent = now ? "Go on " : "Pause ";
}

// ---------------------------------------------------------------------------------------------------- the events

function saved(one) {
  let item = $(`saved-${one.number}`);
  if (!item) { item = made("li", {id: `saved-${one.number}`}); $("saved").append(item); }
  item.replaceChildren(made("code", {}, one.path), ` ${{saved: "", closing: "– closing the loop: ", closed: "– ", failed: "– refused: "}[one.state]}${one.said} `);
  if (one.state === "closed") {
    item.append(made("a", {href: `/report?run=${one.number}&token=${encodeURIComponent(token)}`, target: "_blank", rel: "noopener"}, "report"));
  }
}

function took(event) {
  if (event.run) {
    run = event.run; frames = []; bounds = [];
    moved = {from: 0, to: 0, at: 0, span: 1};
    $("about").textContent = `${run.environment}, scenario ${run.scenario}, belief of ${run.estimator}, seed ${run.seed}`;
    document.querySelector("h1").textContent = run.title;
    begunDial(); begunControls(); begunMenus(); begunQuantities(); driven(""); paused(run.paused); tell("");
  } else if (event.frame) {
    const frame = event.frame, before = frames[frames.length - 1];
    if (before && before.t === frame.t) frames.pop();
    frames.push(frame);
    heard = performance.now();
    if (waiting) { waiting = false; tell(""); }
    if (frame.bound.some(b => b !== null)) bounds.push([frame.t, frame.bound]);
    const now = performance.now(), own = 1000 * run.step / Number($("speed").value || run.speed);
    // An engine that is slower than was asked for is followed at its own pace, from where the picture stands.
    const span = Math.min(Math.max(own, now - moved.at), 1500);
    moved = {from: before ? standing(now) : frame.angle, to: frame.angle, at: now, span};
    if (drives) run.controls.forEach((c, k) => { if (c.held) set(k, frame.values[k] / c.scale, false); });
    if (frame.over) ended(frame);
  } else if (event.saved) saved(event.saved);
  else if (event.note) tell(event.note, event.bad);
  else if ("drives" in event) driven(event.drives);
  else if ("paused" in event) paused(event.paused);
  dirty = true;
}

// The angle at which the picture stands: between two steps it is carried on evenly.
const share = now => Math.min(Math.max((now - moved.at) / moved.span, 0), 1);
const standing = now => (moved.from ?? 0) + ((moved.to ?? 0) - (moved.from ?? 0)) * share(now);

let charted = 0;
function paint(now) {
  requestAnimationFrame(paint);
  const frame = frames[frames.length - 1];
  if (!run || !frame) return;
  if (!waiting && !run.paused && !frame.over && now - heard > 3000 + 1500 * run.step / (Number($("speed").value) || 1)) {
    waiting = true;
    tell("Computing. The first time on this machine the estimator is compiled, which takes up to half a minute.", false);
  }
  const moving = share(now) < 1 && moved.from !== moved.to;
  if (!dirty && !moving) return;
  drawnDial(frame, standing(now));
  if (dirty) {
    drawnWords(frame);
    if (now - charted > 80 || frame.over) { drawnCharts(); closeUp(frame); charted = now; dirty = false; }
  }
  painted.count += 1;
}

function listen() {
  const stream = new EventSource(`/events?token=${encodeURIComponent(token)}`);
  stream.onmessage = message => { for (const event of JSON.parse(message.data)) took(event); };
  stream.onerror = () => tell("insenv play has ended, or cannot be reached. What was saved is kept.");
}

// -------------------------------------------------------------------------------------------------------- hands

$("pause").addEventListener("click", () => ask("pause", !run.paused));
$("speed").addEventListener("change", () => ask("speed", Number($("speed").value)));
$("driver").addEventListener("change", () => ask("drive", $("driver").value));
$("truth").addEventListener("change", () => { dirty = true; charted = tabled = 0; });
$("save").addEventListener("click", () => ask("save", false));
$("close").addEventListener("click", () => ask("save", true));
$("new").addEventListener("click", () => ask("seed", Number($("seed").value)));
addEventListener("resize", () => { dirty = true; charted = 0; });

addEventListener("keydown", event => {
  const on = event.target.tagName, typing = on === "SELECT" || (on === "INPUT" && event.target.type !== "checkbox");
  if (!run || typing || event.ctrlKey || event.altKey || event.metaKey) return;
  const by = {ArrowLeft: -1, ArrowRight: 1}[event.key];
  if (by) set(0, Number($("box-0").value) + by * step(run.controls[0]) * (event.shiftKey ? 10 : 1));
  else if (event.key === "0") set(0, 0);
  else if (event.key === " " && on !== "BUTTON" && on !== "SUMMARY") ask("pause", !run.paused);
  else if (event.key === "Enter" && on !== "BUTTON" && on !== "SUMMARY" && on !== "A" && !run.controls[0].held) give(0);
  else {
    const k = run.signals.findIndex(s => s.key === event.key);
    if (k < 0) return;
    ask("signal", k);
  }
  if (event.key !== "Enter") event.preventDefault();
});

let grabbed = null;
const pulled = event => {
  const box = $("dial").getBoundingClientRect();
  return Math.atan2(box.left + box.width / 2 - event.clientX, box.top + box.height / 2 - event.clientY);
};
$("dial").addEventListener("pointerdown", event => {
  if (!run) return;
  grabbed = {last: pulled(event), sum: 0, from: moved.to || 0};
  $("dial").setPointerCapture(event.pointerId);
});
$("dial").addEventListener("pointermove", event => {
  if (!grabbed) return;
  const now = pulled(event), c = run.controls[0];
  grabbed.sum += error(now, grabbed.last, true);
  grabbed.last = now;
  // A quarter of a turn of the hand is the largest rate; a vehicle follows the hand, and so does a table that is set to an angle.
  if (c.follows) set(0, (grabbed.from + grabbed.sum) / c.scale);
  else if (c.held) set(0, Math.max(-1, Math.min(1, grabbed.sum / (Math.PI / 2))) * c.high / c.scale);
  else {
    set(0, grabbed.sum / c.scale);
    $("ghost").removeAttribute("hidden");
    $("ghost").setAttribute("transform", `rotate(${-(moved.to + grabbed.sum) * 180 / Math.PI})`);
  }
});
for (const end of ["pointerup", "pointercancel"]) $("dial").addEventListener(end, () => {
  if (grabbed && run && !run.controls[0].held && end === "pointerup" && Math.abs(grabbed.sum) > 0.02) give(0);
  grabbed = null;
  $("ghost").setAttribute("hidden", "");
});

listen();
requestAnimationFrame(paint);
