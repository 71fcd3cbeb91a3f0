// A pool, or two arms: errors by recording, and over recorded time.

const kinds = { nominal: ["minus", "diamond"], calibrated: ["plus", "circle"], "never seen": ["other", "square"] };
const floorLine = (c) => doc.noise_floor_mm === null ? [] : [{ xref: "paper", x0: 0, x1: 1, y0: doc.noise_floor_mm, y1: doc.noise_floor_mm, type: "line", line: { color: c.floor, dash: "dash" } }];
const floorTold = (c) => doc.noise_floor_mm === null ? [] : [{ xref: "paper", x: 1, xanchor: "right", y: Math.log10(doc.noise_floor_mm), yanchor: "top", text: "noise floor " + mm(doc.noise_floor_mm) + " mm",
  showarrow: false, font: { size: 11, color: c.floor }, bgcolor: c.paper, opacity: 0.85 }];

// An axis from a third of the smallest to thrice the largest: nominal and calibrated errors are both seen on it.
function logAxis(title, values) {
  const known = values.concat(doc.noise_floor_mm ?? []).filter((v) => v > 0);
  return axis(title, { type: "log", range: [Math.log10(Math.min(...known) / 1.5), Math.log10(Math.max(...known) * 1.5)], dtick: "D2" });
}

function byRecordingFigure() {
  const c = colours(), all = doc.groups;
  const data = Object.entries(kinds).flatMap(([by, [colour, symbol]]) => {
    const own = all.filter((g) => g.by === by);
    if (!own.length) return [];
    return [{ type: "scatter", mode: "markers", name: by, x: own.map((g) => plain(g.name)), y: own.map((g) => g.mean_mm), marker: { color: c[colour], symbol, size: 9 },
      error_y: { type: "data", symmetric: false, color: c[colour], thickness: 1.5, width: 4, array: own.map((g) => g.ci95_mm ? g.ci95_mm[1] - g.mean_mm : 0),
        arrayminus: own.map((g) => g.ci95_mm ? g.mean_mm - Math.max(g.ci95_mm[0], 0) : 0) },
      text: own.map((g) => plain(g.name) + ", " + by + ": " + mm(g.mean_mm) + " mm" + (g.ci95_mm ? " (95 % " + mm(g.ci95_mm[0]) + " to " + mm(g.ci95_mm[1]) + ")" : "") + " on " + g.n + " dwells"),
      hovertemplate: "%{text}<extra></extra>" }];
  });
  return { data, layout: layout({ height: 340, showlegend: true, xaxis: axis("", { type: "category" }), yaxis: logAxis("mean error [mm]", all.map((g) => g.mean_mm)), shapes: floorLine(c), annotations: floorTold(c) }) };
}

const dwellName = (i) => doc.recordings[doc.dwells.recording[i]] + " dwell " + doc.dwells.dwell[i];

function timeFigure() {
  const c = colours(), d = doc.dwells, x = { key: "time", label: "recorded time" + (doc.recordings.length > 1 ? ", without the time between recordings" : "") + " [min]" };
  const text = d.dwell.map((_, i) => plain(dwellName(i)) + (d.held_out[i] ? ", held out" : ""));
  const dots = (name, y) => ({ type: "scatter", mode: "markers", name, x: d.time_min, y, text, hovertemplate: hover(x, doc.error + ", " + name, "mm"),
    marker: { color: c[kinds[name][0]], symbol: kinds[name][1], size: d.dwell.length > 800 ? 3 : 5, opacity: 0.8 } });
  const begin = beginnings(x, "x", "y");
  return { data: [dots("nominal", d.nominal_mm), dots("calibrated", d.fitted_mm)], layout: layout({ height: 360, showlegend: true, xaxis: axis(x.label),
    yaxis: logAxis(doc.error + " [mm]", d.nominal_mm.concat(d.fitted_mm)), shapes: begin.shapes.concat(floorLine(c)), annotations: begin.annotations.concat(floorTold(c)) }) };
}

function start() {
  document.querySelectorAll("#do-next li, #next li, #warnings-table td").forEach(markCommands);
  if ($("by-recording")) chart($("by-recording"), byRecordingFigure);
  chart($("time"), timeFigure);
  dark.addEventListener("change", redraw);
  window.addEventListener("beforeprint", drawAll);
  printing.addEventListener("change", () => drawAll());
  document.documentElement.dataset.ready = "yes";
}
