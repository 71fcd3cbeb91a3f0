// An axis of recorded time, and what the pointer tells of points on it.

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
