// A headless Chromium and what the tests ask of a page in it.
import assert from "node:assert/strict";
import {existsSync, readFileSync} from "node:fs";
import {createRequire} from "node:module";
import {join} from "node:path";
import {pathToFileURL} from "node:url";

const candidates = [process.env.WIREPLAN_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
export const chromiumPath = candidates.find((path) => path && existsSync(path));

// Root has no sandbox; the software renderer stands in for a graphics card.
const kArguments = ["--no-sandbox", "--disable-dev-shm-usage"];
const kSoftware3d = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const kNo3d = ["--disable-3d-apis"];

const modules = process.env.WIREPLAN_PAGE_MODULES ?? process.cwd();
export const hasModules = existsSync(join(modules, "template.html"));
const require = createRequire(join(modules, "package.json"));
const axeSource = () => readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

export const launch = (webgl = true) =>
  require("playwright-core").chromium.launch({
    executablePath: chromiumPath,
    args: [...kArguments, ...(webgl ? kSoftware3d : kNo3d)],
  });

/** Opens a file; gives the page, what went wrong on it, and the time until it could be used [s]. */
export const open = async (browser, file, viewport = {width: 1280, height: 900}) => {
  const context = await browser.newContext({viewport});
  const page = await context.newPage();
  const faults = [];
  const address = pathToFileURL(file).href;
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) faults.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => faults.push(`script: ${error.stack}`));
  page.on("dialog", (dialog) => faults.push(`dialog: ${dialog.message()}`));
  page.on("request", (request) => {
    const url = request.url();
    if (url !== address && !url.startsWith("data:")) faults.push(`request: ${url}`);
  });
  const start = performance.now();
  await page.goto(address);
  await page.waitForSelector("html[data-ready]", {timeout: 60000});
  const seconds = (performance.now() - start) / 1000;
  return {page, faults, seconds, close: () => context.close()};
};

/** The pixels of the 3D view, as a PNG's base64. */
export const picture = async (page) => {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return page.evaluate(() => document.querySelector(".vessel canvas").toDataURL());
};

/** Column `title` of the table of plans, as shown. */
export const column = (page, title) =>
  page.evaluate((wanted) => {
    const table = document.getElementById("plans");
    const at = [...table.tHead.rows[0].cells].findIndex((cell) => cell.textContent === wanted);
    return [...table.tBodies[0].rows].map((row) => row.cells[at].textContent);
  }, title);

/** Pages of a PDF as Chromium writes it. */
export const pageCount = (pdf) => (pdf.toString("latin1").match(/\/Type\s*\/Page\b/g) ?? []).length;

/** Blocks of the sheet that reach beyond it or whose content reaches beyond them, and pairs that overlap. */
export const clippedBlocks = (page) =>
  page.evaluate(() => {
    const sheet = document.getElementById("sheet").getBoundingClientRect();
    const blocks = [...document.querySelectorAll("#sheet > *, #sheet .block")];
    const found = [];
    for (const block of blocks) {
      const box = block.getBoundingClientRect(), name = block.id || block.className || block.tagName;
      if (box.bottom > sheet.bottom + 1 || box.right > sheet.right + 1 || box.left < sheet.left - 1) found.push(`${name} leaves the sheet`);
      if (block.scrollWidth > block.clientWidth + 1) found.push(`${name} is too narrow`);
      if (block.tagName !== "H1" && block.scrollHeight > block.clientHeight + 2) found.push(`${name} is too low`);
      for (const other of blocks) {
        if (other === block || other.contains(block) || block.contains(other)) continue;
        const its = other.getBoundingClientRect();
        const apart = its.top >= box.bottom - 1 || box.top >= its.bottom - 1 || its.left >= box.right - 1 || box.left >= its.right - 1;
        if (!apart) found.push(`${name} lies on ${other.id || other.className}`);
      }
    }
    return found;
  });

/** Findings of axe-core that are serious or critical, with where. */
export const seriousFindings = async (page) => {
  // The page forbids scripts from elsewhere, not those of the debugger.
  await page.evaluate(axeSource());
  const {violations, passes} = await page.evaluate(() => window.axe.run(document, {resultTypes: ["violations"]}));
  assert.ok(passes.length > 20, "axe-core looked at the page");
  return violations
    .filter((v) => ["serious", "critical"].includes(v.impact))
    .map((v) => `${v.id}: ${v.help}: ${v.nodes.slice(0, 3).map((n) => `${n.target} ${n.failureSummary}`).join("; ")}`);
};
