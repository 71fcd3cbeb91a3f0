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
  (doc.dwells.cavity[i] === null ? "" : ", cavity " + doc.dwells.cavity[i]) +
  (doc.dwells.marker[i] === null ? "" : ", marker " + doc.dwells.marker[i]);
const indices = doc.dwells.dwell.map((_, i) => i);
const pointSize = indices.length > 800 ? 3 : 5;
const rescaled = () => $("rescale").checked;

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
