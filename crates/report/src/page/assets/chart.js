// Charts: one look for all, light or dark, drawn when they come into sight.

const dark = window.matchMedia("screen and (prefers-color-scheme: dark)");
const printing = window.matchMedia("print");

// Okabe and Ito's colours; the lighter ones on a dark page. Shapes say the same as colours.
function colours() {
  const night = dark.matches;
  return {
    paper: night ? "#14181d" : "#ffffff",
    // Lightness falls (rises at night) steadily with the error, so that it also reads in grey.
    errors: night ? [[0, "#4a6590"], [0.5, "#8d8f84"], [1, "#ffe945"]] : [[0, "#ead46a"], [0.5, "#7d7c78"], [1, "#00204d"]],
    ink: night ? "#e6edf3" : "#1b1f24",
    soft: night ? "#9da7b1" : "#57606a",
    line: night ? "#38424d" : "#d0d7de",
    ghost: night ? "rgba(157,167,177,0.35)" : "rgba(87,96,106,0.28)",
    plus: night ? "#56b4e9" : "#0072b2",
    minus: night ? "#e69f00" : "#d55e00",
    other: night ? "#9da7b1" : "#7a7f85",
    floor: night ? "#3fc79a" : "#009e73",
    bar: night ? "#56b4e9" : "#0072b2",
    low: night ? "#8a98a6" : "#5a6672",
  };
}
const direction = {
  "1": { name: "arrived moving to +", colour: "plus", symbol: "circle" },
  "-1": { name: "arrived moving to −", colour: "minus", symbol: "diamond" },
  "0": { name: "arrival not known", colour: "other", symbol: "x-thin-open" },
};

// Only the zero of an error means something: horizontal axes have no line there.
function axis(title, more) {
  const c = colours();
  return Object.assign({
    title: { text: title, standoff: 8, font: { size: 12 } }, gridcolor: c.line, zerolinecolor: c.soft, linecolor: c.line,
    tickfont: { size: 11 }, automargin: true, zeroline: false,
  }, more);
}

function layout(more) {
  const c = colours();
  return Object.assign({
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: c.ink, family: "system-ui, sans-serif", size: 12 },
    margin: { l: 58, r: 14, t: 34, b: 46 }, hovermode: "closest", hoverlabel: { align: "left" },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 11 } }, showlegend: false,
  }, more);
}

const config = { responsive: true, displaylogo: false, displayModeBar: false, doubleClick: "reset" };
const charts = new Map();

// A chart in a box: `figure()` gives { data, layout } of what is shown. Drawn now if in sight, else when it is.
function chart(box, figure) {
  charts.set(box, { figure, stale: true, visible: false });
  sight.observe(box);
}

const sight = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    const own = charts.get(entry.target);
    if (!own) continue;
    own.visible = entry.isIntersecting;
    if (own.visible && own.stale) draw(entry.target, own);
  }
}, { rootMargin: "300px" });

function draw(box, own) {
  own.stale = false;
  const { data, layout } = own.figure();
  // Said outright, so that print media cannot fold the box under its drawing.
  box.style.height = layout.height + "px";
  Plotly.react(box, data, layout, config);
}

function redraw() {
  for (const [box, own] of charts) {
    own.stale = true;
    if (own.visible) draw(box, own);
  }
}
function drawAll() { for (const [box, own] of charts) draw(box, own); }

// Smallest and largest of columns, with a margin.
function span(columns, floor = 0) {
  let low = Infinity, high = -Infinity;
  for (const column of columns) for (const v of column) if (v !== null) { low = Math.min(low, v); high = Math.max(high, v); }
  if (!(high >= low)) return [-1, 1];
  const pad = Math.max(0.06 * (high - low), floor, 1e-9);
  return [low - pad, high + pad];
}

// The same without what is far off: twice the width of the middle nine tenths beyond them.
function bulk(columns) {
  const known = columns.flat().filter((v) => v !== null).sort((a, b) => a - b);
  const at = (part) => known[Math.round(part * (known.length - 1))];
  const far = 2 * (at(0.95) - at(0.05));
  return span([far > 0 ? known.filter((v) => v >= at(0.05) - far && v <= at(0.95) + far) : known]);
}

// Marks at the edge of a range for the points beyond it, so that none is lost from sight.
function beyond(x, y, range, unit, more) {
  const out = indices.filter((i) => x[i] !== null && y[i] !== null && (y[i] < range[0] || y[i] > range[1]));
  if (!out.length) return [];
  const inset = 0.02 * (range[1] - range[0]), above = (i) => y[i] > range[1];
  return [{ type: "scatter", mode: "markers", name: out.length + " beyond the axis", x: out.map((i) => x[i]),
    y: out.map((i) => above(i) ? range[1] - inset : range[0] + inset),
    marker: { symbol: out.map((i) => above(i) ? "triangle-up" : "triangle-down"), size: 10, color: colours().minus },
    text: out.map((i) => plain(dwellName(i)) + ": " + mm(y[i]) + " " + plain(unit)), hovertemplate: "%{text}<extra></extra>", ...more }];
}
// The largest of 1, 2, 5, 10, .. and their like that is not above.
const nice = (value) => { const power = 10 ** Math.floor(Math.log10(value)); return [1, 2, 5, 10].map((k) => k * power).filter((k) => k <= 1.0001 * value).pop(); };
// What a mean and its interval are, for the pointer.
const meansTold = (mean, half, unit) => mean.map((m, k) => "bin mean " + digits(m) + (half[k] === null ? "" : " ± " + digits(half[k])) + " " + plain(unit));
const marker = (look, size, opacity) => ({ color: colours()[look.colour], symbol: look.symbol, size, opacity, line: { width: 1, color: colours()[look.colour] } });
