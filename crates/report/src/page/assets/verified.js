// Paths of a verification: one motion at a time, its error over time and its three views.

const shownMotion = () => doc.motions[Number($("motion").value) || 0];

function errorFigure() {
  const c = colours(), m = shownMotion();
  const line = (name, y, colour, dash) => ({ type: "scatter", mode: "lines", name, x: m.time_s, y, line: { color: colour, width: 1.8, dash },
    hovertemplate: "%{x:.2f} s: %{y:.3~g} mm<extra>" + name + "</extra>" });
  return { data: [line("nominal", m.before_mm, c.minus, "dash"), line("calibrated", m.after_mm, c.plus, "solid")],
    layout: layout({ height: 280, showlegend: true, xaxis: axis("time in the motion [s]"), yaxis: axis("error of the tip [mm]", { rangemode: "tozero" }) }) };
}

// A path whose deviation from the measured one can be seen: drawn so many times as large, by a round factor that keeps nearly
// all of it within a tenth of the motion.
function exaggeration(measured, of) {
  const far = measured[0].map((_, i) => Math.hypot(...[0, 1, 2].map((k) => of[k][i] - measured[k][i]))).sort((a, b) => a - b);
  const extent = Math.max(...[0, 1, 2].map((k) => { const [low, high] = span([measured[k]]); return high - low; }));
  const large = far[Math.floor(0.95 * (far.length - 1))] || 0;
  return large > 0 ? Math.max(nice(0.1 * extent / large), 1) : 1;
}

function viewFigure(across, up) {
  const c = colours(), m = shownMotion(), names = ["x", "y", "z"];
  const line = (name, of, colour, dash, width) => {
    const factor = of === m.measured_mm ? 1 : exaggeration(m.measured_mm, of);
    const drawn = (k) => of[k].map((v, i) => m.measured_mm[k][i] + factor * (v - m.measured_mm[k][i]));
    const text = of[0].map((_, i) => m.time_s[i].toFixed(2) + " s: " + names[across] + " " + mm(of[across][i]) + ", " + names[up] + " " + mm(of[up][i]) + " mm" +
      (of === m.measured_mm ? "" : "; off by " + mm(Math.hypot(...[0, 1, 2].map((k) => of[k][i] - m.measured_mm[k][i]))) + " mm"));
    return { type: "scatter", mode: "lines", name: factor > 1 ? name + ", deviation ×" + factor : name, x: drawn(across), y: drawn(up), line: { color: colour, width, dash },
      text, hovertemplate: "%{text}<extra>" + name + "</extra>" };
  };
  return { data: [line("measured", m.measured_mm, c.ink, "solid", 3), line("nominal", m.nominal_mm, c.minus, "dash", 1.6), line("calibrated", m.calibrated_mm, c.plus, "dot", 1.6)],
    layout: layout({ height: 380, showlegend: true, xaxis: axis(names[across] + " [mm]"), yaxis: axis(names[up] + " [mm]", { scaleanchor: "x", scaleratio: 1 }) }) };
}

function start() {
  doc.motions.forEach((m, k) => {
    const option = element("option", m.name);
    option.value = String(k);
    $("motion").append(option);
  });
  if (doc.motions.length > 0) {
    chart($("error"), errorFigure);
    chart($("xy"), () => viewFigure(0, 1));
    chart($("yz"), () => viewFigure(1, 2));
    chart($("xz"), () => viewFigure(0, 2));
    $("motion").addEventListener("change", redraw);
  }
  dark.addEventListener("change", redraw);
  window.addEventListener("beforeprint", drawAll);
  printing.addEventListener("change", () => drawAll());
  document.documentElement.dataset.ready = "yes";
}
