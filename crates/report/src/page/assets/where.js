// Where it fails: over time, on the boards, in space, by group.

function timeFigure() {
  const c = colours(), x = driver("time");
  const first = base(), now = view.shown;
  const rows = [["error_mm", "error [mm]"], ["outward_mm", "outward [mm]"]];
  const extra = driver("temperature") || driver("load");
  const data = [], more = {};
  const count = rows.length + (extra ? 1 : 0);
  const place = (k) => [1 - (k + 1) / count + 0.05, 1 - k / count];
  rows.forEach(([column, title], k) => {
    const yaxis = "y" + (k ? k + 1 : "");
    const what = title.replace(/ \[.*/, "");
    if (!isBase()) data.push({ type: "scatter", mode: "markers", name: "as calibrated", x: x.values, y: first[column],
      marker: { color: c.ghost, size: pointSize }, text: indices.map((i) => plain(dwellName(i)) + ", as calibrated"), hovertemplate: hover(x, what, "mm"),
      showlegend: k === 0, yaxis });
    for (const [held, name, symbol] of [[1, "held out", "circle"], [0, "seen by the fit", "circle-open"]]) {
      const own = indices.filter((i) => now.held_out[i] === held);
      if (!own.length) continue;
      data.push({ type: "scatter", mode: "markers", name: isBase() ? name : view.name + ", " + name, x: own.map((i) => x.values[i]), y: own.map((i) => now[column][i]),
        marker: { color: c.plus, symbol, size: pointSize, opacity: 0.8 }, text: own.map((i) => plain(dwellName(i))),
        hovertemplate: hover(x, what, "mm"), showlegend: k === 0, yaxis });
    }
    const range = rescaled() ? bulk([now[column]]) : bulk([first[column], now[column]]);
    if (column === "error_mm") range[0] = 0;
    data.push(...beyond(x.values, now[column], range, "mm", { yaxis, showlegend: k === 0 }));
    more["yaxis" + (k ? k + 1 : "")] = axis(title, { range, domain: place(k), zeroline: column !== "error_mm" });
  });
  if (extra) {
    const k = rows.length;
    data.push({ type: "scatter", mode: "markers", x: x.values, y: extra.values, marker: { color: c.minus, size: pointSize - 1 }, showlegend: false, yaxis: "y" + (k + 1),
      text: indices.map((i) => plain(dwellName(i))), hovertemplate: hover(x, ...named(extra.label)) });
    more["yaxis" + (k + 1)] = axis(plain(extra.label).replace("load at the tip", "load"), { domain: place(k) });
  }
  more.xaxis = axis(x.label, { anchor: "y" + count });
  const floor = now.noise_floor_mm;
  const marks = rows.map((_, k) => beginnings(x, "x", "y" + (k ? k + 1 : ""))).concat(extra ? beginnings(x, "x", "y" + count) : []);
  const told = { xref: "paper", x: 1, xanchor: "right", y: floor, yanchor: "bottom", text: "declared noise " + mm(floor) + " mm", showarrow: false, font: { size: 11, color: c.floor },
    bgcolor: c.paper, opacity: 0.85 };
  return { data, layout: layout({ height: 150 * count + 70, showlegend: true, ...more, annotations: [...marks[0].annotations, told],
    shapes: [...marks.flatMap((m) => m.shapes), { type: "line", xref: "paper", x0: 0, x1: 1, y0: floor, y1: floor, line: { color: c.floor, dash: "dash" } }] }) };
}

// "temperature [°C]" as its name and its unit.
const named = (label) => label.replace("]", "").split(" [");

// Arrows stay as long as calibrated errors make them, so that a better model is seen to shorten them: enlarged by a round factor,
// with a round error beside them, as large as the larger ones are, that says how long it is drawn. One far longer than these would
// shrink the map: it is cut short, and marked.
function arrowScale(x, y, errors) {
  const known = errors.filter((e) => e !== null).sort((a, b) => a - b);
  const large = Math.max(known[Math.floor(0.9 * (known.length - 1))] || 1, 1e-6);
  const wide = span([x]), high = span([y]);
  const extent = Math.max(wide[1] - wide[0], high[1] - high[0]);
  return { factor: nice(0.2 * extent / large), sample: nice(large), longest: 0.4 * extent };
}

// Lines from their places with a head where they end; `angle` counts from up, clockwise.
function arrowTraces(from, to, line, head) {
  const between = (a, b) => a.flatMap((v, i) => [v, b[i], null]);
  const angle = to.x.map((v, i) => 180 / Math.PI * Math.atan2(v - from.x[i], to.y[i] - from.y[i]));
  return [
    { type: "scatter", mode: "lines", x: between(from.x, to.x), y: between(from.y, to.y), line, hoverinfo: "skip" },
    { type: "scatter", mode: "markers", ...to, ...head, marker: { symbol: "arrow", angle, ...head.marker } },
  ];
}

// The arrow that states the scale, below all that a map shows.
function sampleArrow(x, y, scale) {
  const c = colours(), wide = span([x]), high = span([y]);
  const at = high[0] - 0.1 * Math.max(high[1] - high[0], wide[1] - wide[0]), end = wide[0] + scale.factor * scale.sample;
  const told = "arrow of this length: " + digits(scale.sample) + " mm";
  return [...arrowTraces({ x: [wide[0]], y: [at] }, { x: [end], y: [at] }, { color: c.ink, width: 1.6 },
    { marker: { size: 7, color: c.ink }, text: [told], hovertemplate: "%{text}<extra></extra>" }),
  { type: "scatter", mode: "text", x: [end], y: [at], text: ["  " + told], textposition: "middle right", textfont: { size: 11, color: c.ink }, hoverinfo: "skip" }];
}

function arrows(x, y, dx, dy, own, title, xlabel, ylabel, scale, board) {
  const c = colours();
  const at = (values) => own.map((i) => values[i]);
  const drawn = own.map((i) => Math.min(scale.factor, scale.longest / Math.max(Math.hypot(dx[i], dy[i]), 1e-9)));
  const moved = (places, by) => own.map((i, k) => places[i] + drawn[k] * by[i]);
  const cut = own.map((_, k) => drawn[k] < scale.factor), short = cut.filter(Boolean).length;
  const errors = own.map((i) => view.shown.error_mm[i]);
  const top = rescaled() ? Math.max(...errors) : Math.max(...own.map((i) => base().error_mm[i]));
  const data = [];
  if (board) data.push({ type: "scatter", mode: "markers", x: board.cavities_mm[0], y: board.cavities_mm[1], marker: { symbol: "circle-open", size: 9, color: c.line },
    text: board.names.map((name) => "cavity " + plain(name)), hovertemplate: "%{text}<extra></extra>" });
  data.push(...arrowTraces({ x: at(x), y: at(y) }, { x: moved(x, dx), y: moved(y, dy) }, { color: c.low, width: 1.4 }, {
    marker: { size: 7, line: { color: c.minus, width: cut.map((is) => is ? 3 : 0) }, color: errors, cmin: 0, cmax: top, colorscale: c.errors, showscale: true,
      colorbar: { title: { text: "error [mm]", side: "right", font: { size: 11 } }, thickness: 10, len: 0.9, tickfont: { size: 10 } } },
    text: own.map((i, k) => plain(dwellName(i)) + ": " + mm(view.shown.error_mm[i]) + " mm, of it " + mm(dx[i]) + " and " + mm(dy[i]) + " mm in this view" + (cut[k] ? " (arrow cut short)" : "")),
    hovertemplate: "%{text}<extra></extra>" }), ...sampleArrow(at(x), at(y).concat(moved(y, dy)), scale));
  return { data, layout: layout({ height: 390, margin: { l: 58, r: 10, t: 40, b: 46 }, title: { text: plain(title) + (short ? " (" + short + (short > 1 ? " arrows" : " arrow") + " cut short, orange)" : ""), font: { size: 13 }, x: 0.02 },
    xaxis: axis(xlabel), yaxis: axis(ylabel, { scaleanchor: "x", scaleratio: 1 }) }) };
}

function mapBoxes() {
  const add = (figure, name) => {
    const box = element("div", undefined, "plot");
    box.dataset.map = name;
    $("maps").append(box);
    chart(box, figure);
  };
  const d = doc.dwells, scales = [];
  if (doc.boards.length) {
    const seated = indices.filter((i) => d.cavity[i] !== null);
    const scale = arrowScale(seated.map((i) => d.board_mm[0][i]), seated.map((i) => d.board_mm[1][i]), seated.map((i) => base().error_mm[i]));
    scales.push("×" + scale.factor + " on the boards");
    for (const board of doc.boards) {
      const own = seated.filter((i) => d.recording[i] === board.recording);
      add(() => arrows(d.board_mm[0], d.board_mm[1], view.shown.board_mm[0], view.shown.board_mm[1], own, "board of " + doc.recordings[board.recording],
        "board x [mm]", "board y [mm]", scale, board), doc.recordings[board.recording]);
    }
  }
  const free = indices.filter((i) => d.cavity[i] === null);
  if (free.length) {
    const scale = arrowScale(free.map((i) => d.world_mm[0][i]), free.map((i) => d.world_mm[1][i]), free.map((i) => base().error_mm[i]));
    scales.push("×" + scale.factor + " in space");
    add(() => arrows(d.world_mm[0], d.world_mm[1], view.shown.world_mm[0], view.shown.world_mm[1], free, "free poses from above", "world x [mm]", "world y [mm]", scale), "above");
    add(() => arrows(d.world_mm[0], d.world_mm[2], view.shown.world_mm[0], view.shown.world_mm[2], free, "free poses from the side", "world x [mm]", "world z [mm]", scale), "side");
  }
  $("map-caption").textContent = "Each arrow starts at its place and points the way from where the model puts the tip to where it was, as long as the error " +
    scales.join(" and ") + (d.marker.some((m) => m !== null) ? "; those of markers likewise" : "") + "; the arrow below a map states its scale. The colour is the size of the whole error, with its part across the view.";
}

function groupFigure() {
  const c = colours();
  const kinds = [...new Set(base().groups.map((g) => g.by))];
  const data = [], more = {};
  const top = Math.max(...(rescaled() ? view.shown : base()).groups.map((g) => g.ci95_mm ? g.ci95_mm[1] : g.mean_mm));
  const total = base().groups.length + kinds.length;
  let used = 0;
  kinds.forEach((by, k) => {
    const suffix = k === 0 ? "" : String(k + 1);
    const count = base().groups.filter((g) => g.by === by).length;
    more["yaxis" + suffix] = axis("", { domain: [1 - (used + count) / total, 1 - used / total], autorange: "reversed", type: "category", anchor: "x" });
    used += count + 1;
    const put = (shown, look, name, size) => {
      const own = shown.groups.filter((g) => g.by === by);
      data.push({ type: "scatter", mode: "markers", name, showlegend: k === 0, y: own.map((g) => plain(by + ": " + g.name)), x: own.map((g) => g.mean_mm),
        marker: { color: look, size }, yaxis: "y" + suffix,
        error_x: { type: "data", symmetric: false, color: look, thickness: 1.4, width: 3, array: own.map((g) => g.ci95_mm ? g.ci95_mm[1] - g.mean_mm : 0),
          arrayminus: own.map((g) => g.ci95_mm ? g.mean_mm - g.ci95_mm[0] : 0) },
        text: own.map((g) => plain(g.name) + ": " + mm(g.mean_mm) + " mm on " + g.n + " dwells"), hovertemplate: "%{text}<extra></extra>" });
    };
    if (!isBase()) put(base(), c.ghost, "as calibrated", 7);
    put(view.shown, c.bar, view.name, 8);
  });
  return { data, layout: layout({ height: 60 + 20 * total, margin: { l: 150, r: 14, t: 30, b: 46 }, showlegend: !isBase(),
    xaxis: axis("mean error [mm]", { range: [0, 1.05 * top], anchor: "y" + (kinds.length > 1 ? kinds.length : "") }), ...more }) };
}
