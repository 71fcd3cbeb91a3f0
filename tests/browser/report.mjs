// usage: report.mjs REPORT.html SUMMARY.json FOLDER
// The report from disk: silent, offline, and a click shows the refit with the numbers of summary.json.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { data, drawn, launch, number, open, shown } from "./browser.mjs";

const [report, summaryPath, folder] = process.argv.slice(2);
const summary = JSON.parse(readFileSync(summaryPath, "utf8"));
const address = pathToFileURL(report).href;
const side = (fit) => (fit.holdout.n > 0 ? fit.holdout : fit.train);

// Recorded time leaves no gap where nothing was recorded, and a mark where each recording begins.
async function timeAxes(page, summary) {
  const recordings = summary.recordings.filter((r) => r.dwells > 0);
  const [title, marks, begins, widest] = await page.evaluate(() => {
    const box = document.querySelector("#time"), x = [...driver("time").values].sort((a, b) => a - b);
    const at = box.layout.shapes.filter((s) => s.yref === "y domain").map((s) => s.x0);
    return [box.layout.xaxis.title.text, at, doc.begin_min.filter((v) => v !== null), Math.max(...x.slice(1).map((v, k) => v - x[k])) / (x[x.length - 1] - x[0])];
  });
  assert.deepEqual(marks, recordings.length > 1 ? begins : []);
  assert.equal(title.includes("without the time between recordings"), recordings.length > 1, title);
  assert.ok(widest < 0.2, `a gap of ${widest} of the axis`);
}

// Every map has an arrow that states its scale, drawn as long as it says.
async function statedArrows(page) {
  const maps = await page.$$eval("#maps .plot", (boxes) => boxes.map((box) => {
    const told = box.data.find((t) => t.mode === "text"), line = box.data[box.data.findIndex((t) => t === told) - 2];
    return { text: told.text[0].trim(), length: line.x[1] - line.x[0] };
  }));
  const factors = [...(await page.textContent("#map-caption")).matchAll(/×([\d.]+)/g)].map((m) => Number(m[1]));
  assert.ok(maps.length > 0 && factors.length > 0);
  for (const { text, length } of maps) {
    const mm = Number(/^arrow of this length: (\S+) mm$/.exec(text)[1]);
    assert.ok(/^[125]0*$/.test(String(mm).replace(/^0\.0*/, "").replace(".", "")), `${mm} mm is round`);
    assert.ok(factors.some((factor) => Math.abs(length - factor * mm) < 1e-6 * length), `${text}: ${length} mm at ×${factors}`);
  }
}

// Whatever dot the pointer finds says what it is, and numbers say their unit.
async function tellingPoints(page) {
  const silent = await page.$$eval(".plot", (boxes) => boxes.flatMap((box) => (box.data || []).filter((t) => (t.mode || "").includes("markers") &&
    (t.hoverinfo === "skip" || !(t.hovertemplate || t.hovertext))).map((t) => box.id + " " + box.dataset.channel + " " + t.name)));
  assert.deepEqual(silent, []);
  const unitless = await page.$$eval("#time, #joints .plot, #signatures .plot", (boxes) => boxes.flatMap((box) => (box.data || [])
    .filter((t) => t.mode === "markers" && (t.hovertemplate || "").includes("%{y") && !/%\{y[^}]*\} \S+<extra>/.test(t.hovertemplate)).map((t) => t.hovertemplate)));
  assert.deepEqual(unitless, []);
}

const browser = await launch();
try {
  const { page, seen } = await open(browser, address);
  await drawn(page);
  // That of a pool goes on with what it is worth on another day.
  assert.ok((await page.textContent("#sentence")).trim().startsWith(summary.conclusion));
  assert.equal(await number(page, "#n-before"), side(summary.fit).fitted_mm.mean);
  assert.equal(await number(page, "#n-nominal"), side(summary.fit).nominal_mm.mean);

  const buttons = page.locator("#candidates button");
  const count = await buttons.count();
  assert.ok(count >= 3, `${count} candidates can be clicked`);
  const before = await data(page, "#time");
  const joint = await data(page, "#joints .plot");
  for (let k = 0; k < count; k++) {
    await buttons.nth(k).click();
    const spec = await buttons.nth(k).evaluate((b) => b.closest("tr").dataset.spec);
    const refit = summary.refits.find((r) => r.effects.join("+") === spec);
    assert.ok(refit, `summary.json has the refit with ${spec}`);
    assert.equal(await number(page, "#n-after"), side(refit).fitted_mm.mean, spec);
    assert.ok((await page.textContent("#sentence")).includes(`to ${(await page.textContent("#n-after")).replace(" mm", "")} mm`));
    const after = await shown(page, "#time");
    assert.notDeepEqual(after, before, `${spec} changes the plot over time`);
    // What is drawn is what the headline averages.
    const errors = after.filter((t) => t.name && t.name.startsWith("+") && t.name.endsWith("held out")).flatMap((t) => t.y).slice(0, refit.holdout.n);
    if (refit.holdout.n > 0) {
      const mean = errors.reduce((a, b) => a + b, 0) / errors.length;
      assert.ok(Math.abs(mean - refit.holdout.fitted_mm.mean) < 2e-3 * mean + 1e-4, `${mean} and ${refit.holdout.fitted_mm.mean}`);
    }
    assert.notDeepEqual(await shown(page, "#joints .plot"), joint, `${spec} changes the joints`);
    assert.ok(await page.locator(`tr.selected[data-spec="${spec}"]`).count() === 1);
    console.log(`${spec}: ${await page.textContent("#n-after")} on screen, ${side(refit).fitted_mm.mean} in summary.json`);
  }
  // The answer itself can be shown too.
  const answer = await page.evaluate(() => found() === base() ? null : found().added);
  assert.equal(await page.isVisible("#show-found"), answer !== null);
  if (answer) {
    await page.click("#show-found");
    const refit = summary.refits.find((r) => r.effects.join("+") === answer.join("+"));
    assert.equal(await number(page, "#n-after"), side(refit).fitted_mm.mean, "with what was found");
    assert.equal(await page.isVisible("#show-found"), false);
  }
  // One far point does not flatten a plot, and is not lost from sight.
  const far = await page.evaluate(() => {
    const y = indices.map((i) => i === 3 ? 1000 : Math.sin(i)), range = bulk([y]);
    return { range, marks: beyond(indices, y, range, "mm", {}), none: beyond(indices, y.map(Math.sin), range, "mm", {}) };
  });
  assert.ok(far.range[0] < -0.9 && far.range[1] > 0.9 && far.range[1] < 6, `${far.range}`);
  assert.deepEqual([far.marks.map((m) => m.x), far.marks[0].marker.symbol, far.marks[0].name, far.none], [[[3]], ["triangle-up"], "1 beyond the axis", []]);
  assert.equal((await page.textContent("#do-next")).includes("`"), false, "commands are set as code");
  assert.equal(await page.textContent("#verdict"), summary.answer_sentence.replaceAll("`", ""));
  await drawn(page);
  await timeAxes(page, summary);
  await statedArrows(page);
  await tellingPoints(page);
  await buttons.first().click();
  await drawn(page);
  await page.screenshot({ path: join(folder, "candidate.png"), fullPage: true });
  await page.click("#reset");
  assert.ok((await page.textContent("#sentence")).trim().startsWith(summary.conclusion));
  await drawn(page);
  await page.screenshot({ path: join(folder, "light.png"), fullPage: true });
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true, "no sideways scrolling on a laptop");
  assert.deepEqual(await page.$$eval(".scroll", (all) => all.filter((s) => s.scrollWidth > s.clientWidth).map((s) => s.textContent.slice(0, 60))), [], "no table is wider than the page");
  writeFileSync(join(folder, "print.pdf"), await page.pdf({ format: "A4", landscape: true, printBackground: true }));
  await page.emulateMedia({ media: "print" });
  await page.waitForTimeout(400);
  await page.screenshot({ path: join(folder, "print.png"), fullPage: true });
  // A page behind another one need not be drawn.
  await page.close();

  const night = await open(browser, address, { colorScheme: "dark" });
  await drawn(night.page);
  await night.page.screenshot({ path: join(folder, "dark.png"), fullPage: true });
  for (const { requests, complaints } of [seen, night.seen]) {
    assert.deepEqual(requests.filter((url) => url !== address && !url.startsWith("data:") && !url.startsWith("blob:")), []);
    assert.deepEqual(complaints, []);
  }
  console.log(`no request but ${address}, no complaint in the console`);
} finally {
  await browser.close();
}
