// Paths of a verification: one motion at a time, its error over time and its three views.

const shownMotion = () => doc.motions[Number($("motion").value) || 0];

function errorFigure() {
  const c = colours(), m = shownMotion();
  const line = (name, y, colour, dash) => ({ type: "scatter", mode: "lines", name, x: m.time_s, y, line: { color: colour, width: 1.8, dash },
    hovertemplate: "%{x:.2f} s: %{y} mm<extra>" + name + "</extra>" });
  return { data: [line("nominal", m.before_mm, c.minus, "dash"), line("calibrated", m.after_mm, c.plus, "solid")],
    layout: layout({ height: 280, showlegend: true, xaxis: axis("time in the motion [s]"), yaxis: axis("error of the tip [mm]", { rangemode: "tozero" }) }) };
}

function viewFigure(across, up) {
  const c = colours(), m = shownMotion(), names = ["x", "y", "z"];
  const line = (name, of, colour, dash, width) => ({ type: "scatter", mode: "lines", name, x: of[across], y: of[up], line: { color: colour, width, dash },
    hovertemplate: "%{x}, %{y} mm<extra>" + name + "</extra>" });
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
