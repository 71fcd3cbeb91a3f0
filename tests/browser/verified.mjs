// usage: verified.mjs PAGE.html VERIFICATION.json FOLDER
// The page of a verification: offline, silent, another motion is drawn when it is chosen, means are those of the JSON.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { data, drawn, launch, open } from "./browser.mjs";

const [path, jsonPath, folder] = process.argv.slice(2);
const verification = JSON.parse(readFileSync(jsonPath, "utf8"));
const address = pathToFileURL(path).href;
const browser = await launch();
try {
  const { page, seen } = await open(browser, address);
  await drawn(page);
  const [measured, nominal, calibrated] = await data(page, "#xy");
  // Deviations are drawn so many times as large as the name of their line says.
  const motion = await page.evaluate(() => shownMotion());
  const factor = (line) => Number((/deviation ×(\d+)$/.exec(line.name) || [, "1"])[1]);
  for (const [line, of] of [[nominal, motion.nominal_mm], [calibrated, motion.calibrated_mm]]) {
    assert.ok(/^[125]0*$/.test(factor(line)), `${line.name}: a round factor`);
    const off = of[0].map((x, i) => motion.measured_mm[0][i] + factor(line) * (x - motion.measured_mm[0][i]) - line.x[i]);
    assert.ok(Math.max(...off.map(Math.abs)) < 1e-6, `${line.name} is drawn as it says`);
  }
  const apart = (of) => of[0].reduce((sum, _, i) => sum + Math.hypot(...[0, 1, 2].map((k) => of[k][i] - motion.measured_mm[k][i])), 0);
  assert.ok(apart(motion.calibrated_mm) < 0.05 * apart(motion.nominal_mm), "the calibrated path lies on the measured one");
  assert.ok(factor(calibrated) > factor(nominal), "small deviations are enlarged more");
  await page.selectOption("#motion", "1");
  await drawn(page);
  const [other] = await data(page, "#xy");
  assert.notDeepEqual(other.x, measured.x);
  const all = verification.points.find((r) => r.by === "all");
  const text = await page.textContent("main");
  assert.ok(text.includes((all.before.mean_m * 1e3).toFixed(2)), "the mean before");
  await page.screenshot({ path: join(folder, "verified.png"), fullPage: true });
  assert.deepEqual(seen.requests, [address]);
  assert.deepEqual(seen.complaints, []);
  console.log(await page.textContent("h1"));
} finally {
  await browser.close();
}
