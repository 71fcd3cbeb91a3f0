// The sentence and the numbers on top.

part(() => {
  const own = judged(base()), now = judged(view.shown);
  $("sentence").textContent = view.shown.sentence;
  $("shown-name").textContent = view.name;
  const put = (id, errors) => {
    $(id).textContent = errors ? errors.mean_text + " mm" : "–";
    $(id).dataset.mm = errors ? errors.mean : "";
  };
  put("n-nominal", own.nominal_mm);
  put("n-before", own.fitted_mm);
  put("n-after", now.fitted_mm);
  $("n-floor").textContent = mm(view.shown.noise_floor_mm) + " mm";
  $("n-after-name").textContent = view.name;
  $("with").hidden = isBase();
  $("reset").hidden = isBase();
  $("show-found").hidden = doc.path.length < 2 || view.shown === found();
  const points = now.n + (view.shown.holdout.fitted_mm ? " held-out points" : " points, none held out");
  const change = view.shown.change;
  const interval = change && change.ci95_mm && !isBase()
    ? "; change " + signed(change.difference_mm) + " mm (95 % " + signed(change.ci95_mm[0]) + " to " + signed(change.ci95_mm[1]) + ")" : "";
  $("n-what").textContent = "mean error on " + points + interval;
});
