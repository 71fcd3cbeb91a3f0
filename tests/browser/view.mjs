// usage: view.mjs ADDRESS SUMMARY.json PIPELINE FOLDER SPEC..
// The live page: a combination is refitted, a hold-out changed, a formula tried, and "keep" writes the pipeline.

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { data, drawn, launch, number, open } from "./browser.mjs";

const [address, summaryPath, expected, folder, ...specs] = process.argv.slice(2);
const summary = JSON.parse(readFileSync(summaryPath, "utf8"));
const browser = await launch();
try {
  const { page, seen } = await open(browser, address);
  await page.waitForFunction(() => document.querySelectorAll("#holdout option").length > 2);
  const settled = async (act) => {
    await page.evaluate(() => { document.getElementById("live-status").textContent = ""; });
    await act();
    await page.waitForFunction(() => /refitted|written|!|\./.test(document.getElementById("live-status").textContent), null, { timeout: 60000 });
    return page.textContent("#live-status");
  };
  const before = await number(page, "#n-before");
  assert.equal(before, summary.fit.holdout.fitted_mm.mean);

  // Both at once: what neither a click in the ranking nor summary.json shows.
  for (const spec of specs) {
    const box = page.locator(`#effects input[value="${spec}"]`);
    if (!(await box.count())) {
      await page.fill("#other", spec);
      console.log(await settled(() => page.click("#add-other")));
    } else {
      console.log(await settled(() => box.check()));
    }
  }
  const both = await number(page, "#n-after");
  assert.ok(both < before, `${both} mm with ${specs.join(" and ")}, ${before} mm as calibrated`);
  await drawn(page);
  assert.ok((await data(page, "#time")).some((t) => t.name && t.name.includes(specs.join(" + "))), "the plot shows the combination");
  await page.screenshot({ path: join(folder, "view.png"), fullPage: true });

  // Another hold-out gives another error.
  console.log(await settled(() => page.selectOption("#holdout", { label: "a fifth of the dwells" })));
  assert.notEqual(await number(page, "#n-after"), both);
  console.log(await settled(() => page.selectOption("#holdout", { label: "as in the pipeline" })));
  assert.equal(await number(page, "#n-after"), both, "the same question has the same answer");

  // A formula: what it removes is shown, and nonsense is refused in words.
  await page.fill("#x-name", "wave");
  await page.fill("#x-formula", "k * sin(q1)");
  await page.fill("#x-acts", "q2");
  await page.fill("#x-parameters", "k deg 0.3");
  console.log(await settled(() => page.click("#add-formula")));
  assert.ok((await page.textContent("#shown-name")).includes("wave"));
  await page.fill("#other", "<script>globalThis.pwned = 1</script>:1");
  const refusal = await settled(() => page.click("#add-other"));
  assert.ok(refusal.includes("<script>"), refusal);
  assert.equal(await page.evaluate(() => globalThis.pwned), undefined);
  assert.equal(await page.locator('#effects input[value^="<script>"]').count(), 0, "what was refused is not chosen");
  await settled(() => page.locator('#effects input[value="expression wave"]').uncheck());

  assert.ok(!existsSync(expected));
  const kept = await settled(() => page.click("#keep"));
  assert.ok(existsSync(expected), kept);
  console.log(kept);
  assert.deepEqual(seen.requests.filter((url) => !url.startsWith(address) && !url.startsWith("data:") && !url.startsWith("blob:")), []);
  // The refusal is a 422, which the browser itself notes.
  assert.deepEqual(seen.complaints.filter((c) => !c.includes("422")), []);
} finally {
  await browser.close();
}
