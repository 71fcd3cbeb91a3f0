// The effect by itself: what the measurements say without it, and what the model says it does.

// Sorted points of a line, broken where `anew(k)` says that point k begins something else, and where there are none for long:
// more than a tenth of the range and thrice the usual distance.
function withoutGaps(points, anew) {
  const steps = points.slice(1).map((p, k) => p[0] - points[k][0]);
  const usual = [...steps].sort((a, b) => a - b)[Math.floor(steps.length / 2)];
  const range = steps.reduce((sum, step) => sum + step, 0);
  const long = Math.max(range / 10, 3 * usual);
  return points.flatMap((p, k) => k > 0 && (steps[k - 1] > long || anew(k)) ? [[(p[0] + points[k - 1][0]) / 2, null], p] : [p]);
}

function signatureFigure(signature) {
  const c = colours();
  const channel = doc.channels[signature.channel], x = driver(signature.driver);
  const data = byDirection(channel.joint, (own, look) => ({
    type: "scatter", mode: "markers", name: look.name, x: own.map((i) => x.values[i]), y: own.map((i) => signature.measured[i]),
    marker: marker(look, pointSize, 0.5), text: own.map((i) => plain(dwellName(i))), hovertemplate: hover(x, "measured without the effect", channel.unit),
  }));
  for (const line of byDirection(channel.joint, (own, look) => {
    const order = own.filter((i) => x.values[i] !== null && signature.effect_is[i] !== null).sort((a, b) => x.values[a] - x.values[b]);
    const line = withoutGaps(order.map((i) => [x.values[i], signature.effect_is[i]]), (k) => x.key === "time" && doc.dwells.recording[order[k]] !== doc.dwells.recording[order[k - 1]]);
    return { type: "scatter", mode: "lines", name: "fitted effect", x: line.map((p) => p[0]), y: line.map((p) => p[1]), connectgaps: false,
      line: { color: c[look.colour], width: 2 }, hoverinfo: "skip", showlegend: false };
  })) data.push(line);
  for (const band of signature.bands) {
    const colour = channel.joint === null ? c.ink : c[direction[band.direction].colour];
    data.push({ type: "scatter", mode: "markers", x: band.x, y: band.mean, marker: { symbol: "square", size: 7, color: c.paper, line: { color: colour, width: 2 } },
      error_y: { type: "data", array: band.half, color: colour, thickness: 2, width: 4 }, hoverinfo: "text", showlegend: false,
      hovertext: meansTold(band.mean, band.half, channel.unit) });
  }
  return { data, layout: layout({
    height: 360, showlegend: channel.joint !== null, ...beginnings(x, "x", "y"),
    xaxis: axis(plain(x.label)), yaxis: axis("error of " + plain(channel.label) + " [" + channel.unit + "]", { zeroline: true }),
  }) };
}

function signatureBox(signature) {
  const figure = document.createElement("figure");
  const box = element("div", undefined, "plot");
  const channel = doc.channels[signature.channel];
  const part = signature.share < 0.8 ? " It shows " + (100 * signature.share).toFixed(0) + " % of the effect." : "";
  figure.append(element("h3", told(signature.effect) + " by itself"), box, element("figcaption",
    signature.summary + ". Points: what is measured at " + channel.label + " when the effect is left out and everything else stays as fitted " +
    "beside it; squares: their bin means with 95 % interval. Line: what the fitted effect does there." + part));
  chart(box, () => signatureFigure(signature));
  return figure;
}

// As calibrated, the last step of the path tells what was found; else what is shown.
part(() => {
  const box = $("signatures");
  for (const old of box.querySelectorAll(".plot")) { charts.delete(old); sight.unobserve(old); Plotly.purge(old); }
  const last = found();
  const shown = isBase() ? last : view.shown;
  box.replaceChildren(...shown.signatures.map(signatureBox));
  box.className = shown.signatures.length > 1 ? "grid" : "";
});

function unlistedFigure(shape) {
  const c = colours();
  const above = shape.value.map((v, i) => v + shape.half[i]), below = shape.value.map((v, i) => v - shape.half[i]);
  return { data: [
    { type: "scatter", mode: "lines", x: shape.at.concat([...shape.at].reverse()), y: above.concat(below.reverse()), fill: "toself",
      fillcolor: c.ghost, line: { width: 0 }, hoverinfo: "skip" },
    { type: "scatter", mode: "lines", x: shape.at, y: shape.value, line: { color: c.bar, width: 2 },
      text: shape.half.map((h) => "± " + digits(h)), hovertemplate: plain(shape.driver) + ": %{x:.5~g} " + plain(shape.driver_unit) + "<br>error: %{y:.3~g} %{text} " + plain(shape.unit) + "<extra></extra>" },
  ], layout: layout({ height: 320, xaxis: axis(plain(shape.driver) + (shape.driver_unit ? " [" + shape.driver_unit + "]" : "")),
    yaxis: axis("error at " + plain(shape.channel) + " [" + shape.unit + "]", { zeroline: true }) }) };
}

function unlistedBoxes() {
  for (const shape of doc.unlisted) {
    const figure = document.createElement("figure"), box = element("div", undefined, "plot");
    figure.append(element("h3", "Not in the catalogue: " + shape.channel + " over " + shape.driver), box,
      element("figcaption", "The shape that the measurements ask for, with its 95 % band."));
    $("unlisted").append(figure);
    chart(box, () => unlistedFigure(shape));
  }
}
