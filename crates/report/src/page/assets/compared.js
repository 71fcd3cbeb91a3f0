// Two results on the same dwells.

const colourOf = (k) => [colours().plus, colours().minus, colours().floor, colours().other][k % 4];
const symbolOf = (k) => ["circle", "diamond", "square", "triangle-up"][k % 4];
const nameOf = (p) => doc.recordings[p.recording].name + " dwell " + p.dwell + (p.cavity ? ", cavity " + p.cavity : "");

function pairsFigure() {
  const c = colours();
  const top = 1.05 * Math.max(...doc.pairs.map((p) => Math.max(p.before_mm, p.after_mm)), 1e-6);
  const data = [{ type: "scatter", mode: "lines", x: [0, top], y: [0, top], line: { color: c.soft, dash: "dot", width: 1 }, hoverinfo: "skip", showlegend: false }];
  doc.recordings.forEach((recording, k) => {
    const own = doc.pairs.filter((p) => p.recording === k);
    data.push({ type: "scatter", mode: "markers", name: plain(recording.name), x: own.map((p) => p.before_mm), y: own.map((p) => p.after_mm),
      marker: { color: colourOf(k), symbol: symbolOf(k), size: 6, opacity: 0.7 }, text: own.map((p) => plain(nameOf(p))), hovertemplate: "%{text}<br>from %{x:.3~g} to %{y:.3~g} mm<extra></extra>" });
  });
  return { data, layout: layout({ height: 440, showlegend: true, xaxis: axis("error before [mm]", { range: [0, top] }),
    yaxis: axis("error after [mm]", { range: [0, top] }),
    annotations: [{ x: 0.02 * top, y: 0.97 * top, text: "above the line: worse after, below it: better", showarrow: false, xanchor: "left", font: { color: c.soft } }] }) };
}

function changesFigure() {
  const c = colours();
  const change = doc.by_change.map((k) => doc.pairs[k].after_mm - doc.pairs[k].before_mm);
  return { data: [{ type: "bar", x: change.map((_, i) => i + 1), y: change, marker: { color: change.map((v) => (v < 0 ? c.plus : c.minus)), line: { width: 0 } },
    hovertext: doc.by_change.map((k, i) => plain(nameOf(doc.pairs[k])) + ": " + signed(change[i]) + " mm"), hoverinfo: "text" }],
  layout: layout({ height: 440, bargap: 0, xaxis: axis("dwells, the most improved first"), yaxis: axis("change of the error [mm]", { zeroline: true }) }) };
}

function recordingsFigure() {
  const c = colours();
  const rows = doc.differences;
  return { data: [{ type: "scatter", mode: "markers", y: rows.map((r) => plain(r.name)), x: rows.map((r) => r.difference_mm), marker: { color: c.bar, size: 9 },
    error_x: { type: "data", symmetric: false, color: c.bar, thickness: 1.6, array: rows.map((r) => r.ci95_mm ? r.ci95_mm[1] - r.difference_mm : 0),
      arrayminus: rows.map((r) => r.ci95_mm ? r.difference_mm - r.ci95_mm[0] : 0) }, hovertemplate: "%{y}: %{x:.3f} mm<extra></extra>" }],
  layout: layout({ height: 90 + 34 * rows.length, margin: { l: 160, r: 14, t: 20, b: 46 }, xaxis: axis("change of the mean error [mm], 95 % interval", { zeroline: true, rangemode: "tozero" }),
    yaxis: axis("", { type: "category", autorange: "reversed" }) }) };
}

function start() {
  chart($("pairs"), pairsFigure);
  chart($("changes"), changesFigure);
  chart($("recordings"), recordingsFigure);
  dark.addEventListener("change", redraw);
  window.addEventListener("beforeprint", drawAll);
  printing.addEventListener("change", () => drawAll());
  document.documentElement.dataset.ready = "yes";
}
