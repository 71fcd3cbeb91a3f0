// A campaign: errors of all recordings over time, and one quantity at a time.

const when = (ms) => ms.map((t) => new Date(t).toISOString());
const named = (rows) => rows.map((r) => plain(doc.recordings[r]));

function errorsFigure() {
  const c = colours(), e = doc.errors;
  const dots = (name, y, colour, symbol) => ({ type: "scatter", mode: "markers", name, x: when(e.time_ms), y, text: named(e.row), marker: { color: colour, symbol, size: 7 },
    hovertemplate: "%{text}<br>%{x}: %{y:.3f} mm<extra>" + name + "</extra>" });
  return { data: [dots("nominal", e.before, c.minus, "diamond"), dots("calibrated", e.after, c.plus, "circle"), dots("declared noise", e.floor, c.floor, "line-ew-open")],
    layout: layout({ height: 320, showlegend: true, xaxis: axis("start of the recording (UTC)", { type: "date" }), yaxis: axis("mean error [mm]", { type: "log" }) }) };
}

const shownCurve = () => doc.curves[Number($("quantity").value) || 0];

function curveFigure() {
  const c = colours(), q = shownCurve();
  const changed = q.row.map((r) => q.marks.includes(r));
  const points = { type: "scatter", mode: "markers", x: when(q.time_ms), y: q.value, text: named(q.row),
    marker: { size: q.row.map((_, i) => (changed[i] ? 11 : 7)), color: q.row.map((_, i) => (changed[i] ? c.minus : c.plus)), symbol: q.row.map((_, i) => (changed[i] ? "diamond" : "circle")) },
    error_y: { type: "data", array: q.half.map((h) => h ?? 0), color: c.ghost, thickness: 1.2, width: 0 },
    hovertemplate: "%{text}<br>%{x}: %{y:.5~g} " + plain(q.unit || "") + "<extra></extra>" };
  return { data: [points],
    layout: layout({ height: 360, xaxis: axis("start of the recording (UTC)", { type: "date" }), yaxis: axis(plain(q.name) + (q.unit ? " [" + q.unit + "]" : "")) }) };
}

function start() {
  document.querySelectorAll("#do-next li, #next li, #warnings-table td").forEach(markCommands);
  doc.curves.forEach((q, k) => {
    const option = element("option", q.name + (q.marks.length > 0 ? "  (changes)" : ""));
    option.value = String(k);
    $("quantity").append(option);
  });
  if (doc.recordings.length > 0) chart($("errors"), errorsFigure);
  if (doc.curves.length > 0) {
    chart($("curve"), curveFigure);
    $("quantity").addEventListener("change", redraw);
  }
  dark.addEventListener("change", redraw);
  window.addEventListener("beforeprint", drawAll);
  printing.addEventListener("change", () => drawAll());
  document.documentElement.dataset.ready = "yes";
}
