// The panel beside the picture: values of joints with small curves, and the legend.
"use strict";

// NOISE: a value below this fraction of the joint's largest value in the same unit is shown as 0, because rows are float32
const SPARK = { width: 84, height: 20, points: 84 }, NOISE = 1e-7;

function shownNumber(x) {
  if (!Number.isFinite(x)) return "–";
  const size = Math.abs(x);
  return size !== 0 && (size >= 1e5 || size < 1e-3) ? x.toExponential(2) : x.toPrecision(4);
}

const made = (name, properties = {}, ...inside) => { const e = Object.assign(document.createElement(name), properties); e.append(...inside); return e; };

function largest(channel) {
  let out = 0;
  for (let i = 0; i <= last; i++) if (Number.isFinite(at(i, channel))) out = Math.max(out, Math.abs(at(i, channel)));
  return out;
}

// A small curve of a value over the run: lowest and highest value in each column of pixels.
function spark(channel, large) {
  const { width: w, height: h, points: n } = SPARK;
  const low = new Array(n).fill(Infinity), high = new Array(n).fill(-Infinity);
  for (let i = 0; i <= last; i++) {
    const x = at(i, channel), k = Math.min(n - 1, Math.floor(n * (times[i] - start) / ((end - start) || 1)));
    if (Number.isFinite(x)) { low[k] = Math.min(low[k], x); high[k] = Math.max(high[k], x); }
  }
  const bottom = Math.min(...low), top = Math.max(...high), y = (x) => (top - bottom > NOISE * large ? h - 2 - (h - 4) * (x - bottom) / (top - bottom) : h / 2);
  const spots = low.flatMap((x, k) => (Number.isFinite(x) ? [[k + 0.5, y(x)], [k + 0.5, y(high[k])]] : []));
  const box = made("td");
  box.innerHTML = `<svg viewBox="0 0 ${w} ${h}" aria-hidden="true"><polyline class="curve" points="${spots.map((p) => p.map((v) => v.toFixed(1)).join()).join(" ")}"/><line class="now" y1="0" y2="${h}" x1="0" x2="0"/></svg>`;
  return box;
}

// A table of a joint's values; ``update`` fills in the numbers.
function table(joint, curves) {
  const box = made("table");
  for (const v of joint.values) v.large ??= Math.max(...joint.values.filter((o) => o.unit === v.unit).map((o) => largest(o.channel)));
  for (const v of joint.values) {
    const row = box.insertRow();
    for (const text of [v.label, "", v.unit]) row.insertCell().textContent = text;
    if (curves) row.append(spark(v.channel, v.large));
  }
  return box;
}

// Fill the panel with all joints that have values. The first joints with friction are open (without friction, the first joints).
function panel() {
  const told = run.joints.filter((j) => j.values.length), boxes = told.map((j) => {
    const box = made("details", { open: j.panel }, made("summary", {}, made("b", { textContent: j.name }), " " + j.type)), fill = () => {
      if (box.open && box.children.length < 2) box.append(table(j, true));
      update($("values"));
    };
    box.ontoggle = () => { j.panel = box.open; fill(); };
    box.joint = j;
    if (j.panel) box.append(table(j, true));
    return box;
  });
  const closed = told.filter((j) => !j.panel).length;
  const note = closed ? [made("p", { className: "note", textContent: `${closed} of ${told.length} joints are folded below: unfold them, or point at a joint in the picture.` })] : [];
  $("values").replaceChildren(...note, ...boxes);
}

const quiet = (x, large) => (Math.abs(x) < NOISE * large ? 0 : x);

function update(box) {
  if (!shown.m) return;
  for (const d of box.querySelectorAll("details[open], .tip")) {
    const cells = d.querySelectorAll("td:nth-child(2)"), where = (SPARK.width * (clock.t - start) / ((end - start) || 1)).toFixed(1);
    d.joint.values.forEach((v, k) => { if (cells[k]) cells[k].textContent = shownNumber(v.factor * quiet(nearest(shown.m.w, v.channel), v.large)); });
    for (const line of d.querySelectorAll(".now")) { line.setAttribute("x1", where); line.setAttribute("x2", where); }
  }
}

// Show the values of the joint under the pointer, beside the pointer.
function tip() {
  const box = $("tip");
  box.hidden = !hover;
  if (!hover) return;
  if (box.dataset.key !== hover.joint.name) {
    box.dataset.key = hover.joint.name;
    const inner = made("div", { className: "tip" }, made("b", { textContent: `${hover.joint.name} (${hover.joint.type})` }), table(hover.joint, false));
    inner.joint = hover.joint;
    box.replaceChildren(inner);
  }
  update(box);
  box.style.left = Math.max(4, Math.min(hover.x + 14, window.innerWidth - box.offsetWidth - 6)) + "px";
  box.style.top = Math.max(4, Math.min(hover.y + 10, window.innerHeight - 60 - box.offsetHeight)) + "px";
}

// Fill the legend: colours of contact points and pressures, and the length of the arrow of a round force.
function legend() {
  const box = $("legend");
  box.replaceChildren();
  if (!run.joints.some((j) => j.contacts.length)) return;
  const dots = made("div", { className: "states" }, "contact: ");
  for (const [key, [color, text]] of Object.entries(run.states)) {
    if (key === "other") continue;
    const mark = made("i");
    mark.style.background = color;
    dots.append(made("span", {}, mark, text));
  }
  box.append(dots);
  if (run.pressure > 0) {
    const bar = made("i", { className: "ramp" });
    bar.style.background = `linear-gradient(90deg, ${run.colors.ramp.join()})`;
    box.append(made("div", { title: "normal force divided by the projected area of the contact" }, "nominal pressure: 0 ", bar, ` ${shownNumber(run.pressure / 1e6)} MPa`));
  }
  const metres = run.force * run.arrow * look.arrows;
  box.append(made("div", { textContent: `arrow: normal force on the pin; ${run.force} N is drawn ${shownNumber(metres)} m long` }));
}
