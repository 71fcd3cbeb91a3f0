// usage: hostile.mjs REPORT.html NAME..
// Names from a recording that would be markup, scripts or paths stay text, in the page and in its charts.

import assert from "node:assert/strict";
import { pathToFileURL } from "node:url";
import { drawn, launch, open } from "./browser.mjs";

const [report, ...names] = process.argv.slice(2);
const browser = await launch();
try {
  const { page, seen } = await open(browser, pathToFileURL(report).href);
  await drawn(page);
  // In the page as it is; where only a chart says it, with its markup spelt out, which the chart shows as it is.
  const text = await page.evaluate(() => document.body.textContent);
  const charts = JSON.stringify(await page.evaluate(() => [...document.querySelectorAll(".plot")].map((box) => box.data.map((t) => [t.name, t.text]))));
  const spelt = (name) => JSON.stringify(name.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;")).slice(1, -1);
  for (const name of names) assert.ok(text.includes(name) || charts.includes(spelt(name)), `${JSON.stringify(name)} is shown as it is`);
  for (const name of names.filter((n) => n.includes("<"))) assert.ok(!charts.includes(JSON.stringify(name).slice(1, -1)), `${name} as markup in a chart`);
  const found = await page.evaluate(() => ({
    scripts: document.scripts.length,
    pwned: globalThis.pwned,
    // What a name could have made of itself: elements in what is neither the page's nor a chart's.
    made: [...document.querySelectorAll("img, iframe, object, embed, link, base, form[action], [onerror], [onload], [onclick], a[href]:not([href^='#'])")].map((e) => e.outerHTML),
    bold: [...document.querySelectorAll("svg tspan[style*=bold], svg a")].map((e) => e.outerHTML),
  }));
  assert.deepEqual(found, { scripts: 3, pwned: undefined, made: [], bold: [] });
  assert.deepEqual(seen.complaints, []);
  console.log(`${names.length} names stayed text`);
} finally {
  await browser.close();
}
