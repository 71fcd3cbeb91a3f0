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
    if (!isBase()) data.push({ type: "scatter", mode: "markers", name: "as calibrated", x: x.values, y: first[column],
      marker: { color: c.ghost, size: pointSize }, hoverinfo: "skip", showlegend: k === 0, yaxis });
    for (const [held, name, symbol] of [[1, "held out", "circle"], [0, "seen by the fit", "circle-open"]]) {
      const own = indices.filter((i) => now.held_out[i] === held);
      if (!own.length) continue;
      data.push({ type: "scatter", mode: "markers", name: isBase() ? name : view.name + ", " + name, x: own.map((i) => x.values[i]), y: own.map((i) => now[column][i]),
        marker: { color: c.plus, symbol, size: pointSize, opacity: 0.8 }, text: own.map((i) => plain(dwellName(i))),
        hovertemplate: "%{text}<br>%{y} mm<extra></extra>", showlegend: k === 0, yaxis });
    }
    const range = rescaled() ? bulk([now[column]]) : bulk([first[column], now[column]]);
    if (column === "error_mm") range[0] = 0;
    data.push(...beyond(x.values, now[column], range, "mm", { yaxis, showlegend: k === 0 }));
    more["yaxis" + (k ? k + 1 : "")] = axis(title, { range, domain: place(k), zeroline: column !== "error_mm" });
  });
  if (extra) {
    const k = rows.length;
    data.push({ type: "scatter", mode: "markers", x: x.values, y: extra.values, marker: { color: c.minus, size: pointSize - 1 }, showlegend: false, yaxis: "y" + (k + 1), hoverinfo: "y" });
    more["yaxis" + (k + 1)] = axis(plain(extra.label).replace("load at the tip", "load"), { domain: place(k) });
  }
  more.xaxis = axis(x.label, { anchor: "y" + count });
  const floor = now.noise_floor_mm;
  return { data, layout: layout({ height: 150 * count + 70, showlegend: true, ...more,
    shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: floor, y1: floor, line: { color: c.floor, dash: "dash" } }] }) };
}

// Arrows stay as long as calibrated errors make them, so that a better model is seen to shorten them.
const nice = (value) => { const power = 10 ** Math.floor(Math.log10(value)); return [1, 2, 5, 10].map((k) => k * power).filter((k) => k <= value).pop(); };
function arrowScale(x, y, errors) {
  const known = errors.filter((e) => e !== null).sort((a, b) => a - b);
  const large = known[Math.floor(0.9 * (known.length - 1))] || 1;
  const wide = span([x]), high = span([y]);
  return nice(0.12 * Math.max(wide[1] - wide[0], high[1] - high[0]) / Math.max(large, 1e-6));
}

function arrows(x, y, dx, dy, own, title, xlabel, ylabel, scale, cavities) {
  const c = colours();
  const px = [], py = [];
  for (const i of own) { px.push(x[i], x[i] + scale * dx[i], null); py.push(y[i], y[i] + scale * dy[i], null); }
  const errors = own.map((i) => view.shown.error_mm[i]);
  const top = rescaled() ? Math.max(...errors) : Math.max(...own.map((i) => base().error_mm[i]));
  const data = [];
  if (cavities) data.push({ type: "scatter", mode: "markers", x: cavities[0], y: cavities[1], marker: { symbol: "circle-open", size: 9, color: c.line }, hoverinfo: "skip" });
  data.push({ type: "scatter", mode: "lines", x: px, y: py, line: { color: c.low, width: 1.4 }, hoverinfo: "skip" });
  data.push({ type: "scatter", mode: "markers", x: own.map((i) => x[i] + scale * dx[i]), y: own.map((i) => y[i] + scale * dy[i]),
    marker: { size: 6, color: errors, cmin: 0, cmax: top, colorscale: c.errors, showscale: true,
      colorbar: { title: { text: "error [mm]", side: "right", font: { size: 11 } }, thickness: 10, len: 0.9, tickfont: { size: 10 } } },
    text: own.map((i) => plain(dwellName(i)) + ": " + mm(view.shown.error_mm[i]) + " mm"), hovertemplate: "%{text}<extra></extra>" });
  return { data, layout: layout({ height: 360, margin: { l: 58, r: 10, t: 40, b: 46 }, title: { text: plain(title), font: { size: 13 }, x: 0.02 },
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
    scales.push("on the boards ×" + scale + " (1 mm of error is " + scale + " mm long)");
    for (const board of doc.boards) {
      const own = seated.filter((i) => d.recording[i] === board.recording);
      add(() => arrows(d.board_mm[0], d.board_mm[1], view.shown.board_mm[0], view.shown.board_mm[1], own, "board of " + doc.recordings[board.recording],
        "board x [mm]", "board y [mm]", scale, board.cavities_mm), doc.recordings[board.recording]);
    }
  }
  const free = indices.filter((i) => d.cavity[i] === null);
  if (free.length) {
    const scale = arrowScale(free.map((i) => d.world_mm[0][i]), free.map((i) => d.world_mm[1][i]), free.map((i) => base().error_mm[i]));
    scales.push("in space ×" + scale);
    add(() => arrows(d.world_mm[0], d.world_mm[1], view.shown.world_mm[0], view.shown.world_mm[1], free, "free poses from above", "world x [mm]", "world y [mm]", scale), "above");
    add(() => arrows(d.world_mm[0], d.world_mm[2], view.shown.world_mm[0], view.shown.world_mm[2], free, "free poses from the side", "world x [mm]", "world z [mm]", scale), "side");
  }
  $("map-caption").textContent = "Each line starts at its place and points, enlarged, the way from where the model puts the tip to where it was; the dot is " +
    "its head. Enlarged " + scales.join(", ") + ". The colour is the size of the whole error.";
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
