// What all parts of the report share: what is shown, and its dwells.

// What is shown: a calibration of the document, or one that came live.
const view = { shown: doc.refits[0], name: "as calibrated" };
const parts = [];

// Registers a part of the page: a function that draws what is shown.
function part(draw) { parts.push(draw); }

function show(shown, name) {
  view.shown = shown;
  view.name = name;
  parts.forEach((draw) => draw());
}

const base = () => doc.refits[0];
const isBase = () => view.shown === base();
// The model with everything that was found.
const found = () => doc.refits[doc.path[doc.path.length - 1]];
// An effect as people read it: an event with its moment.
const told = (spec) => doc.told[spec] || spec;
const label = (shown) => shown.added.length ? "+ " + shown.added.map(told).join(" + ") : "as calibrated";

// The side of the hold-out that counts: points the fit never saw, where there are any.
const judged = (shown) => shown.holdout.fitted_mm ? shown.holdout : shown.train;

const driver = (key) => doc.drivers.find((d) => d.key === key);
const dwellName = (i) => doc.recordings[doc.dwells.recording[i]] + " dwell " + doc.dwells.dwell[i] +
  (doc.dwells.cavity[i] === null ? "" : ", cavity " + doc.dwells.cavity[i]);
const indices = doc.dwells.dwell.map((_, i) => i);
const pointSize = indices.length > 800 ? 3 : 5;
const rescaled = () => $("rescale").checked;

// Where recordings begin on an axis of time; more of them than these have their names in the hover text alone.
const NAMED_BEGINNINGS = 8;
function beginnings(x, xref, yref) {
  const all = doc.recordings.map((name, k) => ({ name, at: doc.begin_min[k] })).filter((r) => r.at !== null);
  if (x.key !== "time" || all.length < 2) return { shapes: [], annotations: [] };
  const c = colours();
  const shapes = all.map((r) => ({ type: "line", xref, x0: r.at, x1: r.at, yref: yref + " domain", y0: 0, y1: 1, line: { color: c.soft, width: 1, dash: "dot" } }));
  const annotations = all.length > NAMED_BEGINNINGS ? [] : all.map((r) => ({ xref, x: r.at, yref: yref + " domain", y: 1, text: plain(r.name), showarrow: false,
    xanchor: "left", yanchor: "top", xshift: 2, font: { size: 11, color: c.soft }, bgcolor: c.paper, opacity: 0.85 }));
  return { shapes, annotations };
}

// What the pointer tells of points: which dwell, and both values with their units. A label ends in its unit, "time [min]".
function hover(x, name, unit) {
  const [, what, of] = /^(.*?)(?: \[([^\]]*)\])?$/.exec(x.label);
  return "%{text}<br>" + plain(what) + ": %{x:.5~g} " + plain(of || "") + "<br>" + plain(name) + ": %{y:.3~g} " + plain(unit) + "<extra></extra>";
}

// Points of a joint by direction of arrival, or one kind for all.
function byDirection(joint, of) {
  if (joint === null) return [of(indices, { name: "dwell", colour: "plus", symbol: "circle" }, null)];
  const all = [];
  for (const sign of [1, -1, 0]) {
    const own = indices.filter((i) => doc.arrival[joint][i] === sign);
    if (own.length) all.push(of(own, direction[sign], sign));
  }
  return all;
}
