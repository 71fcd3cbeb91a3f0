// Served by `armcal view`: combinations, formulas and hold-outs, refitted as they are chosen. Then the page starts.

function live() {
  const chosen = new Map(doc.own_effects.map((spec) => [spec, { spec, on: true }]));
  for (const c of doc.candidates) for (const spec of c.spec.split("+")) if (!chosen.has(spec)) chosen.set(spec, { spec, on: false });
  let running = false, wanted = false;
  let accepted = null; // What the last refit that was not refused was asked with.

  const draw = () => {
    $("effects").replaceChildren(...[...chosen.entries()].map(([name, effect]) => {
      const box = document.createElement("input");
      box.type = "checkbox";
      box.checked = effect.on;
      box.value = name;
      box.addEventListener("change", () => { effect.on = box.checked; refit(); });
      const label = document.createElement("label");
      label.append(box, " " + told(name));
      return label;
    }));
  };
  const request = () => {
    const on = [...chosen.values()].filter((e) => e.on);
    return { effects: on.filter((e) => e.spec).map((e) => e.spec), expressions: on.filter((e) => e.expression).map((e) => e.expression),
      holdout: JSON.parse($("holdout").value) };
  };
  const ask = async (what, body) => {
    const answer = await fetch(what, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });
    const value = await answer.json();
    if (!answer.ok) throw Object.assign(new Error(value.error), { refused: answer.status < 500 });
    return value;
  };
  const state = () => ({ on: new Set([...chosen].filter(([, e]) => e.on).map(([name]) => name)), known: new Set(chosen.keys()), holdout: $("holdout").value });
  // What was refused is no choice: back to what was accepted last.
  const restore = () => {
    for (const [name, effect] of chosen) {
      if (!accepted.known.has(name)) chosen.delete(name);
      effect.on = accepted.on.has(name);
    }
    $("holdout").value = accepted.holdout;
    draw();
  };
  const refitOnce = async () => {
    try {
      await ready;
      const own = state();
      const value = await ask("refit", request());
      accepted = own;
      if (wanted) return; // Somebody clicked on.
      $("live-status").textContent = "refitted in " + value.milliseconds.toFixed(0) + " ms";
      const names = value.shown.effects.map(told).join(" + ");
      show(value.shown, names ? "with " + names : "geometry alone");
    } catch (error) {
      if (wanted) return;
      if (error.refused && accepted) restore();
      $("live-status").textContent = error.message;
    }
  };
  // One at a time; of what is clicked meanwhile only the last is asked for.
  const refit = async () => {
    wanted = true;
    $("live-status").textContent = "refitting …";
    if (running) return;
    running = true;
    while (wanted) {
      wanted = false;
      await refitOnce();
    }
    running = false;
  };
  const parameters = (text) => Object.fromEntries(text.split(";").map((p) => p.trim().split(/\s+/)).filter((p) => p[0])
    .map(([name, unit, prior]) => [name, { unit, prior: Number(prior) }]));

  $("add-other").addEventListener("click", () => {
    const spec = $("other").value.trim();
    if (!spec) return;
    chosen.set(spec, { spec, on: true });
    $("other").value = "";
    draw();
    refit();
  });
  $("add-formula").addEventListener("click", () => {
    const expression = { name: $("x-name").value.trim(), formula: $("x-formula").value, acts_on: $("x-acts").value.trim(), parameters: parameters($("x-parameters").value) };
    chosen.set("expression " + expression.name, { expression, on: true });
    draw();
    refit();
  });
  $("workbench").addEventListener("submit", (event) => event.preventDefault());
  $("holdout").addEventListener("change", refit);
  $("keep").addEventListener("click", async () => {
    try {
      await ready;
      const value = await ask("keep", request());
      $("live-status").textContent = "written: " + value.pipeline;
    } catch (error) {
      $("live-status").textContent = error.message;
    }
  });
  // The run behind the page is made when the first question comes.
  const begun = state();
  const offer = async () => {
    const answer = await fetch("choices");
    const choices = await answer.json();
    if (!answer.ok) throw new Error(choices.error);
    $("catalogue").replaceChildren(...choices.effects.map((spec) => { const option = document.createElement("option"); option.value = spec; return option; }));
    $("holdout").replaceChildren(...choices.holdouts.map(([name, value]) => { const option = element("option", name); option.value = JSON.stringify(value); return option; }));
    accepted = { ...begun, holdout: $("holdout").value };
  };
  const ready = offer();
  ready.catch((error) => { $("live-status").textContent = error.message; });
  draw();
}

function start() {
  candidateTable();
  unlistedBoxes();
  channelBoxes();
  mapBoxes();
  chart($("path"), pathFigure);
  chart($("time"), timeFigure);
  chart($("groups"), groupFigure);
  part(redraw);
  if (!$("live").hidden) live();
  $("reset").addEventListener("click", () => show(base(), "as calibrated"));
  $("show-found").addEventListener("click", () => show(found(), "with what was found"));
  $("rescale").addEventListener("change", redraw);
  dark.addEventListener("change", redraw);
  window.addEventListener("beforeprint", drawAll);
  printing.addEventListener("change", () => drawAll());
  for (const said of document.querySelectorAll("#verdict, #do-next li, #next li, #next dd, #next td, #missing > ul li, #warnings-table td")) markCommands(said);
  document.querySelectorAll("td:not(.hash, .num)").forEach(breakable);
  show(base(), "as calibrated");
  document.documentElement.dataset.ready = "yes";
}
