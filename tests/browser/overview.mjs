// usage: overview.mjs PAGE.html RESULT.json FOLDER NAME
// The page of two arms: offline, silent, its first screen says what the result says, its charts draw its numbers.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { data, drawn, launch, open } from "./browser.mjs";

const [path, jsonPath, folder, name] = process.argv.slice(2);
const result = JSON.parse(readFileSync(jsonPath, "utf8"));
const address = pathToFileURL(path).href;
const near = (a, b, what) => assert.ok(Math.abs(a - b) <= 2e-3 * Math.abs(b), `${what}: ${a}, not ${b}`);
const browser = await launch();
try {
  const { page, seen } = await open(browser, address);
  // The first screen, without scrolling: what was reached, whether it stands, what to do next.
  for (const [selector, says] of [["#verdict", result.conclusion], ["#status", result.status === "ok" ? "Status: ok." : "exit code 3"], ["#do-next", "Next:"]]) {
    const box = await page.$(selector);
    assert.ok((await box.textContent()).includes(says), `${selector} says ${says}`);
    const { y, height } = await box.boundingBox();
    assert.ok(y + height < 820, `${selector} is on the first screen`);
  }
  await page.screenshot({ path: join(folder, `${name}-first.png`) });
  await drawn(page);

  const judged = result.fit.holdout.n > 0 ? result.fit.holdout : result.fit.train;
  const [nominal, calibrated] = await data(page, "#time");
  const mean = (values) => values.reduce((sum, v) => sum + v, 0) / values.length;
  assert.equal(calibrated.y.length, judged.n);
  near(mean(calibrated.y), judged.fitted_mm.mean, "mean of what is drawn over time");
  near(mean(nominal.y), judged.nominal_mm.mean, "mean of what is drawn over time, nominal");
  if (result.recordings.length > 1) {
    const lines = await data(page, "#by-recording");
    for (const [line, errors] of [["nominal", "nominal_mm"], ["calibrated", "fitted_mm"]]) {
      const own = lines.find((l) => l.name === line);
      result.recordings.forEach((r, k) => near(own.y[k], r[errors].mean, `${line} ${r.name}`));
    }
  } else {
    assert.equal(await page.$("#by-recording"), null, "one recording is compared with none");
  }

  // Every free parameter has a row, and what is not determined says so.
  for (const p of result.fit.parameters.filter((p) => p.free)) {
    const row = page.locator(`tr[data-parameter="${p.name}"]`);
    assert.equal((await row.locator(".flag").textContent()).includes("undetermined"), !p.determined, p.name);
  }
  const severities = await page.locator("#warnings-table .flag").allTextContents();
  const order = ["data_lost", "inadequate", "notice"].map((word) => severities.lastIndexOf(word)).filter((at) => at >= 0);
  assert.deepEqual(order, [...order].sort((a, b) => a - b), "the gravest first");
  await page.screenshot({ path: join(folder, `${name}.png`), fullPage: true });
  assert.deepEqual(seen.requests, [address]);
  assert.deepEqual(seen.complaints, []);
  console.log(await page.textContent("h1"));
} finally {
  await browser.close();
}
