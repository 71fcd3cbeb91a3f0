// The ranking; a click shows the refit with one of its entries.

function candidateRow(c) {
  const name = document.createElement(c.refit === null ? "span" : "button");
  name.textContent = c.spec.split("+").map(told).join(" + ");
  name.title = c.summary;
  if (c.refit !== null) {
    name.type = "button";
    name.dataset.refit = c.refit;
    name.addEventListener("click", () => show(doc.refits[c.refit], label(doc.refits[c.refit])));
  }
  const what = document.createElement("div");
  what.append(c.found ? "● " : "", name, element("div", c.summary, "faint"));
  const refit = c.refit === null ? null : doc.refits[c.refit];
  const change = refit && refit.change;
  const made = row([what, c.behind_nats === null ? "–" : c.behind_nats.toFixed(1) + " ± " + c.behind_se.toFixed(1), c.probability === null ? "–" : c.probability.toFixed(3), c.p_adjusted.toFixed(3), refit ? judged(refit).fitted_mm.mean_text : "–",
    change && change.ci95_mm ? signed(change.ci95_mm[0]) + " to " + signed(change.ci95_mm[1]) : "–",
    (100 * c.absorbed).toFixed(0) + " %", c.size, c.also.join(", ")]);
  made.dataset.spec = c.spec;
  if (c.refit !== null) made.dataset.refit = c.refit;
  for (const k of [1, 4, 5]) made.cells[k].className = "num";
  made.cells[8].className = "faint";
  return made;
}

function candidateTable() {
  const table = $("candidates");
  if (!table) return; // None was weighed.
  const head = document.createElement("thead");
  head.append(row(["explanation", "behind [nats]", "probability", "p", "error with it [mm]", "change, 95 % [mm]", "geometry can hide", "size", "also called, or the same here"], "th"));
  const body = document.createElement("tbody");
  body.append(...doc.candidates.map(candidateRow));
  table.replaceChildren(head, body);
  part(() => {
    for (const own of body.rows) own.classList.toggle("selected", !isBase() && doc.refits[own.dataset.refit] === view.shown);
  });
}
