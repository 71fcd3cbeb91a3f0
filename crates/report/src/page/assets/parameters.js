// Old and new parameters of what is shown.

part(() => {
  const head = document.createElement("thead");
  head.append(row(["parameter", "unit", "nominal", "value", "change", "± 95 %", "", "what it is"], "th"));
  const body = document.createElement("tbody");
  for (const p of view.shown.parameters.filter((p) => p.free)) {
    const notes = [p.determined ? "" : "undetermined", p.at_bound ? "at its bound" : ""].filter(Boolean).join(", ");
    const made = row([told(p.name), p.unit, p.nominal, p.value, p.change, p.half, element("span", notes, "flag"), element("span", p.meaning, "faint")]);
    made.dataset.parameter = p.name;
    body.append(made);
  }
  $("parameter-table").replaceChildren(head, body);
});
