// Geometry, then what was found, one effect after the other: bars that fall towards the declared noise.

// A long name on up to three lines, broken after a space, a comma or an underscore.
function wrapped(text, width) {
  const lines = [""];
  for (const word of text.match(/[^ _,]+[ _,]*/g) || []) {
    const last = lines[lines.length - 1];
    if (last && (last + word).trimEnd().length > width) lines.push(word);
    else lines[lines.length - 1] += word;
  }
  return lines.slice(0, 3).map(plain).join("<br>");
}

// What a step adds, without the shapes of it; many of them by their number.
const together = (added) => added.length > 3 ? added.length + " effects" : added.map((spec) => told(spec).split(",")[0]).join(", ");

function pathFigure() {
  const c = colours();
  const steps = doc.path.map((k) => doc.refits[k]);
  const names = steps.map((s, k) => k === 0 ? (doc.own_effects.length ? "with " + doc.own_effects.map(told).join(", ") : "geometry")
    : "+ " + together(s.added.slice(steps[k - 1].added.length)));
  const means = steps.map((s) => judged(s).fitted_mm.mean);
  if (!steps.includes(view.shown) && !isBase()) {
    names.push("shown: " + view.name);
    means.push(judged(view.shown).fitted_mm.mean);
  }
  const floor = base().noise_floor_mm;
  const data = [{
    type: "bar", x: names.map((n, i) => i), y: means, text: means.map((m) => mm(m)), textposition: "outside", cliponaxis: false,
    marker: { color: means.map((_, i) => i < steps.length ? c.bar : c.minus) }, hoverinfo: "text",
    hovertext: names.map((n, i) => plain(n) + ": " + mm(means[i]) + " mm"), width: 0.62,
  }];
  return { data, layout: layout({
    height: 290, margin: { l: 54, r: 10, t: 34, b: 56 },
    xaxis: axis("", { tickvals: names.map((_, i) => i), tickangle: 0, ticktext: names.map((n) => wrapped(n, 12)), gridcolor: "rgba(0,0,0,0)", range: [-0.6, Math.max(names.length, 3) - 0.4] }),
    yaxis: axis("mean error [mm]", { rangemode: "tozero", range: [0, 1.15 * Math.max(...means, floor)] }),
    shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: floor, y1: floor, line: { color: c.floor, width: 2, dash: "dash" } }],
    annotations: [{ xref: "paper", yref: "paper", x: 1, y: 1.12, text: "- - declared noise " + mm(floor) + " mm", showarrow: false, xanchor: "right", font: { color: c.floor, size: 12 } }],
  }) };
}

part(() => {
  const own = judged(base());
  const seen = base().holdout.fitted_mm ? "points the fit never saw" : "points the fit saw (nothing was held out)";
  $("path-caption").textContent = "Mean error on " + own.n + " " + seen + ". The nominal arm: " + own.nominal_mm.mean_text + " mm.";
});
