// A fresh headless Chromium that notes everything a page asks for and complains about.

import { chromium } from "playwright-core";
import { existsSync } from "node:fs";

const PLACES = [process.env.ARMCAL_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync"];

export async function launch() {
  const executablePath = PLACES.find((place) => place && existsSync(place));
  if (!executablePath) throw new Error("no Chromium; set ARMCAL_CHROMIUM");
  return chromium.launch({ executablePath, args: FLAGS, headless: true });
}

// A page as wide as a laptop's; `seen` collects its requests and complaints.
export async function open(browser, address, { colorScheme = "light" } = {}) {
  const context = await browser.newContext({ viewport: { width: 1366, height: 820 }, colorScheme });
  const page = await context.newPage();
  const seen = { requests: [], complaints: [] };
  page.on("request", (request) => seen.requests.push(request.url()));
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) seen.complaints.push(message.text());
  });
  page.on("pageerror", (error) => seen.complaints.push(String(error)));
  await page.goto(address);
  await page.waitForSelector("html[data-ready=yes]", { timeout: 60000 });
  return { page, seen };
}

// Keeps a chart in sight until it shows what it should now show: charts above it that grow while they are drawn push it out
// again, and on a busy machine a drawing takes seconds.
async function fresh(page, box) {
  const ready = (own) => {
    if (own.data && !charts.get(own).stale) return true;
    own.scrollIntoView({ block: "center" });
    return false;
  };
  await page.waitForFunction(ready, box, { timeout: 120000, polling: 100 });
}

// Draws every chart, and returns to the top.
export async function drawn(page) {
  for (const box of await page.$$(".plot")) await fresh(page, box);
  await page.evaluate(() => scrollTo(0, 0));
}

// The numbers that a chart should now show, once it does.
export async function shown(page, selector) {
  await fresh(page, await page.$(selector));
  return data(page, selector);
}

// The numbers behind a chart.
export const data = (page, selector) =>
  page.$eval(selector, (box) => box.data.map((t) => ({ name: t.name, x: [...(t.x || [])], y: [...(t.y || [])] })));

export const number = (page, selector) => page.$eval(selector, (e) => Number(e.dataset.mm));
