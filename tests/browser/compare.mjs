// usage: compare.mjs PAGE.html COMPARISON.json FOLDER
// The page of a comparison: offline, silent, and as many dwells as `armcal compare --json` counts.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { data, drawn, launch, open } from "./browser.mjs";

const [path, jsonPath, folder] = process.argv.slice(2);
const comparison = JSON.parse(readFileSync(jsonPath, "utf8"));
const address = pathToFileURL(path).href;
const browser = await launch();
try {
  const { page, seen } = await open(browser, address);
  await drawn(page);
  const [changes] = await data(page, "#changes");
  assert.equal(changes.y.length, comparison.all.n);
  assert.equal(changes.y.filter((y) => y < 0).length, comparison.all.better);
  const mean = changes.y.reduce((a, b) => a + b, 0) / changes.y.length;
  assert.ok(Math.abs(mean - comparison.all.difference_mm) < 1e-9);
  const text = await page.textContent("main");
  for (const moved of comparison.moved.slice(0, 3)) assert.ok(text.includes(moved.name), moved.name);
  await page.screenshot({ path: join(folder, "compare.png"), fullPage: true });
  assert.deepEqual(seen.requests, [address]);
  assert.deepEqual(seen.complaints, []);
  console.log(await page.textContent("h1"));
} finally {
  await browser.close();
}
