// Implied errors of each joint, and of all lengths: over angle, torque and time, by direction of arrival.

// A third of a row has no place for a long label: what it is is said there, the rest on hover and over time.
const shortly = (label) => label.replace(", without the time between recordings", ", gaps left out").replace(/^gravity torque on .* \[/, "gravity torque [");

function channelFigure(k) {
  const c = colours();
  const channel = doc.channels[k], keys = doc.drawn[k];
  const data = [], shapes = [], annotations = [];
  const more = {};
  const y = view.shown.implied[k];
  const range = rescaled() ? bulk([y]) : bulk([base().implied[k], y]);
  keys.forEach((key, panel) => {
    const suffix = panel === 0 ? "" : String(panel + 1), x = driver(key);
    const axes = { xaxis: "x" + suffix, yaxis: "y" };
    if (!isBase()) data.push({ type: "scatter", mode: "markers", x: x.values, y: base().implied[k], marker: { color: c.ghost, size: pointSize - 1 },
      text: indices.map((i) => plain(dwellName(i)) + ", as calibrated"), hovertemplate: hover(x, "implied error", channel.unit), showlegend: false, ...axes });
    data.push(...byDirection(channel.joint, (own, look) => ({
      type: "scatter", mode: "markers", name: look.name, legendgroup: look.name, showlegend: panel === 0 && channel.joint !== null,
      x: own.map((i) => x.values[i]), y: own.map((i) => y[i]), marker: marker(look, pointSize, 0.55),
      text: own.map((i) => plain(dwellName(i))), hovertemplate: hover(x, "implied error", channel.unit), ...axes,
    })));
    data.push(...beyond(x.values, y, range, channel.unit, { showlegend: panel === 0, ...axes }));
    for (const band of view.shown.bands.filter((b) => b.channel === k && b.driver === key)) {
      const look = band.direction === null ? { colour: "plus" } : direction[band.direction];
      data.push({ type: "scatter", mode: "lines", x: band.x, y: band.mean, line: { color: c[look.colour], width: 2.5 }, showlegend: false,
        error_y: { type: "data", array: band.half, color: c[look.colour], thickness: 1.5, width: 3 }, hoverinfo: "text",
        hovertext: meansTold(band.mean, band.half, channel.unit), ...axes });
    }
    const begin = beginnings(x, "x" + suffix, "y");
    shapes.push(...begin.shapes);
    annotations.push(...begin.annotations);
    const width = 1 / keys.length, gap = 0.025;
    more["xaxis" + suffix] = axis(plain(shortly(x.label)), { domain: [panel * width + (panel ? gap : 0), (panel + 1) * width - gap / 2], anchor: "y" });
  });
  more.yaxis = axis(plain(channel.label) + " off by [" + channel.unit + "]", { range, zeroline: true, zerolinewidth: 1.5 });
  return { data, layout: layout({ height: 300, showlegend: true, shapes, annotations, ...more }) };
}

function channelBoxes() {
  const without = doc.drawn.flatMap((keys, k) => keys.length ? [] : [doc.channels[k].label]);
  if (without.length) $("joints").append(element("p", "Not drawn, because " + (without.length > 1 ? "they hardly move" : "it hardly moves") + " the tip: " + without.join(", ") + ".", "caption"));
  doc.drawn.forEach((keys, k) => {
    if (!keys.length) return;
    const box = element("div", undefined, "plot");
    box.dataset.channel = doc.channels[k].key;
    $("joints").append(box);
    chart(box, () => channelFigure(k));
  });
}
