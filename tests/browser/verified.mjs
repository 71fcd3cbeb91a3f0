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
  const apart = (a, b) => a.x.reduce((sum, x, i) => sum + Math.hypot(x - b.x[i], a.y[i] - b.y[i]), 0) / a.x.length;
  assert.ok(apart(measured, calibrated) < 0.05 * apart(measured, nominal), "the calibrated path lies on the measured one");
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
