// node test_page.mjs [REPORT.html...]: report.html in a real browser. Without arguments on a small
// case with hostile names, run by WIREPLAN_PROGRAM, and on a made-up large one of
// WIREPLAN_MAKE_LARGE_PAGE. WIREPLAN_PAGE_MODULES is the folder with node_modules of the page.
// WIREPLAN_SCREENSHOTS, where given, is a folder for pictures of every page.
import assert from "node:assert/strict";
import {execFileSync, spawnSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync, statSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {basename, dirname, join, resolve} from "node:path";
import {after, before, describe, test} from "node:test";
import {chromiumPath, clippedBlocks, column, hasModules, launch, open, pageCount, picture, seriousFindings} from "./browser.mjs";
import {hostileCase, hostileWire, runSmallCase, runSmallMoving, runSmallSections} from "./small_case.mjs";

const kMegabyte = 1e6;
const kSkipped = 77;
const skip = (reason) => {
  console.log(`page: skipped, ${reason}`);
  process.exit(kSkipped);
};
if (!chromiumPath) skip("no Chromium (package chromium, or set WIREPLAN_CHROMIUM)");
if (!hasModules) skip("no template of report.html: npm ci failed when wireplan was built");

const folder = mkdtempSync(join(tmpdir(), "wireplan-page-"));
let browser, flat;
before(async () => {
  browser = await launch();
  flat = await launch(false);
});
after(async () => {
  await browser.close();
  await flat.close();
  rmSync(folder, {recursive: true});
});

const kSheetBlocks = ["verdict", "why", "changes", "picture", "plans", "access", "uncertain", "fetch", "lengths"];

/** Everything on the page that a pointer could use. */
const countControls = (page) =>
  page.evaluate(() => {
    const wanted = "a[href], button, select, input, summary, canvas, [tabindex='0']";
    const usable = (node) => !node.disabled && node.tabIndex >= 0 && node.checkVisibility();
    const nodes = [...document.querySelectorAll(wanted)].filter(usable);
    nodes.forEach((node, k) => (node.dataset.control = k));
    return nodes.length;
  });

const checkPage = (title, file) => {
  describe(title, () => {
    // A page takes seconds to open, so the tests of one follow each other on it; after one that fails it is opened anew.
    let opened;
    const leave = async () => {
      await opened?.close();
      opened = undefined;
    };
    after(leave);
    const check = async ({page, faults}, body) => {
      await body(page);
      assert.deepEqual(faults, []);
    };
    const use = (name, body) =>
      test(name, async () => {
        opened ??= await open(browser, file());
        try {
          await check(opened, body);
        } catch (fault) {
          await leave();
          throw fault;
        }
      });
    const useAlone = (name, body, viewport) =>
      test(name, async () => {
        const own = await open(browser, file(), viewport);
        try {
          await check(own, body);
        } finally {
          await own.close();
        }
      });

    use("loads from a file without errors and requests, and names what it is", async (page) => {
      assert.match(await page.textContent("header"), /Research use only/);
      assert.ok((await page.textContent("#answer")).length > 100);
      assert.equal(await page.locator(".vessel canvas").count(), 1);
      assert.ok(await page.locator("#charts svg[role=img]").count() >= 1);
    });

    use("shows the plan that is picked", async (page) => {
      const first = await page.inputValue("#pick-trial");
      await page.selectOption("#filter-rank", "all");
      const pick = page.locator("#plans tbody button").nth(1);
      const trial = await pick.getAttribute("data-trial");
      const before = await page.textContent(".chosen[role=status]");
      await pick.click();
      assert.equal(await page.inputValue("#pick-trial"), trial);
      assert.notEqual(await page.textContent(".chosen[role=status]"), before);
      assert.equal(await pick.getAttribute("aria-pressed"), "true");
      await page.selectOption("#pick-trial", first);
    });

    use("moves the wire along its insertion", async (page) => {
      const [inserted, atEnd] = [await page.inputValue("#insertion"), await picture(page)];
      assert.ok(Number(inserted) > 0);
      await page.focus("#insertion");
      await page.keyboard.press("Home");
      const atStart = await picture(page);
      assert.notEqual(atStart, atEnd, "the wire is drawn elsewhere");
      assert.match(await page.textContent("#insertion-state"), /^0\u00a0mm inserted/);
      await page.keyboard.press("End");
      assert.equal(await picture(page), atEnd, "and comes back");
      await page.click("#play");
      await page.waitForFunction(() => Number(document.getElementById("insertion").value) > 0);
      await page.focus("#insertion");
      await page.keyboard.press("End");  // which stops it
    });

    use("colors the wall by the forces that are asked for", async (page) => {
      const seen = new Set();
      for (const wall of ["plan", "all", "none"]) {
        await page.selectOption("#pick-wall", wall);
        seen.add(await picture(page));
      }
      assert.equal(seen.size, 3);
    });

    use("turns the vessel by keyboard and by its buttons", async (page) => {
      await page.click("text=From the front");
      const front = await picture(page);
      await page.focus(".vessel canvas");
      await page.keyboard.press("ArrowLeft");
      assert.notEqual(await picture(page), front);
      await page.click("text=From the front");
      assert.equal(await picture(page), front);
    });

    use("sorts the table both ways and filters it by wire", async (page) => {
      await page.selectOption("#filter-rank", "all");
      // Whichever angle the case varies; else the rank, by which it is sorted already.
      let title = "Rank";
      for (const angle of ["Inclination", "Azimuth", "Roll"]) {
        if (new Set(await column(page, angle)).size > 1) title = angle;
      }
      assert.ok(given.length || title !== "Rank", "the small case varies an angle");
      const numbers = async () => (await column(page, title)).map((text) => (text === "\u2013" ? Infinity : parseFloat(text)));
      if (title === "Rank") await page.click(`#plans th button:text-is("${title}")`);
      await page.click(`#plans th button:text-is("${title}")`);
      const rising = await numbers();
      assert.ok(new Set(rising).size > 1, "there is something to sort");
      assert.deepEqual(rising, [...rising].sort((a, b) => a - b));
      await page.focus(`#plans th button:text-is("${title}")`);
      await page.keyboard.press("Enter");
      const falling = await numbers();
      assert.deepEqual(falling, [...falling].sort((a, b) => b - a));
      const wires = new Set(await column(page, "Wire"));
      await page.selectOption("#filter-wire", "0");
      const left = await column(page, "Wire");
      assert.equal(new Set(left).size, 1);
      if (wires.size > 1) assert.ok(left.length < rising.length);
    });

    use("lets the Tab key reach every control, and arrows every trial of the grid", async (page) => {
      const count = await countControls(page);
      assert.ok(count > 25, `${count} controls`);
      const reached = new Set();
      await page.evaluate(() => window.scrollTo(0, 0));
      for (let k = 0; k < count + 5; ++k) {
        await page.keyboard.press("Tab");
        const control = await page.evaluate(() => document.activeElement?.dataset.control ?? null);
        if (control !== null) reached.add(control);
      }
      assert.equal(reached.size, count);

      // From the chosen cell through its row and column.
      await page.focus('#heat-grid button[tabindex="0"]');
      const cells = new Set();
      for (const key of ["ArrowLeft", "ArrowUp", "ArrowRight", "ArrowDown"]) {
        for (let k = 0; k < 3; ++k) {
          await page.keyboard.press(key);
          cells.add(await page.evaluate(() => document.activeElement.dataset.trial));
        }
      }
      assert.ok(cells.size > (await page.locator("#heat-grid button").count() > 1 ? 1 : 0) && !cells.has(undefined));
      await page.keyboard.press("Enter");
      assert.equal(await page.inputValue("#pick-trial"),
        await page.evaluate(() => document.activeElement.dataset.trial));
    });

    use("shows slices at the places that are asked for, or says that there is no volume", async (page) => {
      if (await page.locator("#place").count() === 0) {
        assert.match(await page.textContent("#slices"), /there is no volume/);
        return;
      }
      const images = () => page.evaluate(() => [...document.querySelectorAll("#slices image")].map((i) => i.getAttribute("href")));
      const first = await images();
      assert.equal(await page.locator("#slices svg image").count(), 3);
      assert.ok((await page.locator("#slices .outline").first().getAttribute("d")).length > 100, "an outline");
      await page.focus("#place");
      await page.keyboard.press("End");
      assert.ok((await images()).every((image, k) => k === 0 || image !== first[k]), "other slices");
    });

    use("tells access, views and lengths where the report has them", async (page) => {
      if (await page.locator("#anatomy").count() === 0) return;
      const text = await page.textContent("#anatomy");
      assert.match(text, /Sheath, in the first \d+\u00a0mm/);  // a case may ask for another length
      assert.match(text, /Way from access to target/);
      assert.ok(await page.locator("#anatomy table").count() >= 2);
    });

    use("has no serious finding of axe-core", async (page) => {
      await page.evaluate(() => document.querySelectorAll("details").forEach((d) => (d.open = true)));
      assert.deepEqual(await seriousFindings(page), []);
    });

    useAlone("fits a phone, also there without a serious finding", async (page) => {
      const [wide, screen] = await page.evaluate(() => [document.documentElement.scrollWidth, window.innerWidth]);
      assert.ok(wide <= screen, `${wide} px on a screen of ${screen} px`);
      assert.deepEqual(await seriousFindings(page), []);
    }, {width: 375, height: 740});

    use("begins with one sheet that has all blocks", async (page) => {
      assert.equal(await page.evaluate(() => document.querySelector("main > *").firstChild.id), "sheet");
      for (const id of kSheetBlocks) {
        const text = await page.textContent(`#sheet-${id}`);
        assert.ok(text.length > 20, `${id}: ${text}`);
      }
      assert.match(await page.textContent("#sheet .statement"), /Research use only/);
      assert.match(await page.textContent("#sheet .answer-word"), /^(Feasible|Feasible with risk|Unsure|Not feasible)$/);
      assert.equal(await page.locator("#sheet-picture svg[role=img]").count(), 1);
      assert.ok(await page.locator("#verdict li").count() >= await page.locator("#sheet-why li:not(.more)").count());
      assert.deepEqual(await clippedBlocks(page), []);
      const shot = await page.locator("#sheet").screenshot();
      assert.ok(shot.length > 20000, `a picture of ${shot.length} bytes is not blank`);
    });

    useAlone("prints the sheet on one page, with no block cut off", async (page) => {
      assert.equal(pageCount(await page.pdf({preferCSSPageSize: true})), 1);
      assert.equal(pageCount(await page.pdf({format: "A4"})), 1);
      await page.emulateMedia({media: "print"});
      await page.setViewportSize({width: 718, height: 1047}); // A4, less 1 cm at each side
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
      assert.deepEqual(await clippedBlocks(page), []);
      assert.ok(await page.isHidden("#answer"), "the rest of the page is not printed");
    });

    useAlone("prints the whole page on request, with nothing cut off at the side", async (page) => {
      await page.evaluate(() => (window.print = () => {}));
      await page.click("text=Print the whole page");
      await page.emulateMedia({media: "print"});
      await page.setViewportSize({width: 1047, height: 718}); // A4 across, less 1 cm at each side
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth));
      const pdf = await page.pdf({preferCSSPageSize: true});
      assert.ok(pageCount(pdf) > 3, `${pageCount(pdf)} pages`);
      assert.ok(pdf.length > 50000, `${pdf.length} bytes`);
    });

    test("shows a picture where the browser draws no 3D", async () => {
      const opened = await open(flat, file());
      const drawn = await opened.page.evaluate(() => document.querySelector(".vessel img")?.alt ?? "");
      assert.match(drawn, /vessel/);
      // The library tells the console that there is no context; nothing else may be amiss.
      assert.deepEqual(opened.faults.filter((fault) => !/WebGL/.test(fault)), []);
      await opened.close();
    });

    if (process.env.WIREPLAN_SCREENSHOTS) {
      for (const width of [1280, 375]) {
        useAlone(`is photographed ${width} px wide`, async (page) => {
          await page.waitForTimeout(500);
          await page.screenshot({
            path: join(process.env.WIREPLAN_SCREENSHOTS, `${basename(dirname(file()))}-${width}.png`), fullPage: true});
        }, {width, height: 900});
      }
    }
  });
};

const given = process.argv.slice(2).map((path) => resolve(path));
for (const file of given) checkPage(file, () => file);

if (!given.length) {
  let small, large;
  before(() => {
    small = runSmallCase(process.env.WIREPLAN_PROGRAM, join(folder, "small"));
    large = join(folder, "large.html");
    execFileSync(process.env.WIREPLAN_MAKE_LARGE_PAGE, [large, hostileCase], {stdio: "pipe"});
  });
  checkPage("a small case", () => small);

  test("keeps a sheet of long names and many reasons on its page", async () => {
    const {page, close} = await open(browser, large);
    assert.equal(pageCount(await page.pdf({preferCSSPageSize: true})), 1);
    assert.deepEqual(await clippedBlocks(page), []);
    const steps = await page.textContent("#sheet-plans .steps");
    for (let k = 1; k <= 9; ++k) assert.ok(steps.includes(`${k}. `), `step ${k} of: ${steps}`);
    assert.match(steps, /turn [\d.]+\u00b0 /);
    assert.doesNotMatch(steps, /\bdeg\b/);
    assert.match(await page.textContent("#sheet-why .more"), /^\d+ more below\.$/);
    assert.equal(await page.locator("#verdict li").count(), 28, "below are all");
    await close();
  });

  test("is printed by wireplan render --pdf", () => {
    const render = (report, out) => spawnSync(process.env.WIREPLAN_PROGRAM,
      ["render", report, "-o", out, "--pdf"], {encoding: "utf8", env: {...process.env, WIREPLAN_CHROMIUM: chromiumPath}});
    const out = join(folder, "it's a folder #1");
    const done = render(join(dirname(small), "report.json"), out);
    assert.equal(done.status, 0, done.stderr);
    assert.match(done.stdout, /sheet\.pdf/);
    const pdf = readFileSync(join(out, "sheet.pdf"));
    assert.equal(pageCount(pdf), 1);
    assert.ok(pdf.length > 20000, `${pdf.length} bytes`);
  });

  test("compares the accesses of each target on the page of an overview", async () => {
    const overview = runSmallSections(process.env.WIREPLAN_PROGRAM, join(folder, "sections"));
    for (const width of [1280, 375]) {
      const {page, faults, close} = await open(browser, overview, {width, height: 900});
      assert.deepEqual(await page.locator("main h2").allTextContents(), ["low", "high"]);
      const links = await page.locator("main tbody a").evaluateAll((nodes) => nodes.map((node) => [node.textContent, decodeURI(node.href)]));
      assert.deepEqual(links.map(([text]) => text).sort(), ["from above", "from above", "from below", "from below"]);
      for (const [, address] of links) assert.ok(statSync(new URL(address)).size > 1e5, address);
      assert.match(await page.textContent("main"), /Research use only/);
      assert.match(await page.textContent("main"), /1\.0\d \(below mild\)/, "tortuosity");
      const heads = await page.locator("main thead").first().locator("th").allTextContents();
      assert.ok(heads.includes("Sheath") && heads.includes("Calcium"), heads.join());
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(wide <= 0, `${wide} px too wide`);
      if (width > 1000) assert.equal(pageCount(await page.pdf({preferCSSPageSize: true})), 1);
      if (process.env.WIREPLAN_SCREENSHOTS) {
        await page.screenshot({path: join(process.env.WIREPLAN_SCREENSHOTS, `overview-${width}.png`), fullPage: true});
      }
      assert.deepEqual(faults, []);
      await close();
    }
  });

  test("shows the vessel where the wire moves it", async () => {
    const file = runSmallMoving(process.env.WIREPLAN_PROGRAM, join(folder, "moving"));
    const {page, faults, close} = await open(browser, file);
    const state = page.locator("#insertion-state"), moves = page.locator("#vessel-moves"), slider = page.locator("#insertion");
    const [, moved] = (await state.textContent()).match(/the vessel moved by ([\d.]+)/);
    assert.ok(Number(moved) > 0.3, `moved by ${moved} mm`);
    assert.ok(await moves.isChecked());
    const shifted = await picture(page);
    await moves.uncheck();
    const rest = await picture(page);
    assert.notEqual(shifted, rest);
    await moves.check();
    assert.equal(await picture(page), shifted);
    await slider.fill("0");
    assert.match(await state.textContent(), /the vessel moved by 0/);
    const told = await page.locator("#motion tbody tr").allTextContents();
    assert.ok(told.some((row) => row.startsWith("Length of the way")), told.join("; "));
    const unknowns = await page.locator("#uncertain tbody tr").allTextContents();
    assert.ok(unknowns.some((row) => /^Support of the vesseltimes 0\.1 to 10, in 2 repeats/.test(row)), unknowns.join("; "));
    assert.deepEqual(faults, []);
    await close();
  });

  test("shows hostile names as text", async () => {
    const named = await open(browser, large);
    assert.ok((await named.page.textContent("h1")).includes(hostileCase));
    assert.equal(await named.page.evaluate(() => window.harmed), undefined);
    assert.deepEqual(named.faults, []);
    await named.close();

    const {page, faults, close} = await open(browser, small);
    assert.equal(await page.evaluate(() => window.harmed), undefined);
    const wires = await column(page, "Wire");
    const shown = hostileWire.replace("\u202e", "\u27e8U+202E\u27e9").replace("\u2028", "\u27e8U+2028\u27e9");
    assert.ok(wires.includes(shown), wires.join());
    assert.equal(await page.locator("main img").count(), 0, "no picture but the slices'");
    assert.ok(!(await page.textContent("main")).includes("\u202e"), "nothing turns the text round");
    assert.deepEqual(faults, []);
    await close();
  });

  test("tells of a run with half the push that comes less far", async () => {
    const text = readFileSync(small, "utf8"), file = join(folder, "half.html");
    assert.ok(text.includes('"incomplete":""'), "the best plan was run so, and came as far");
    writeFileSync(file, text.replaceAll('"incomplete":""', '"incomplete":"with pushes half as long it is stuck"'));
    for (const [where, told] of [[small, /its tip ends at most [\d.e-]+\s*mm away/], [file, /half as long: it does not come as far/]]) {
      const {page, faults, close} = await open(browser, where);
      assert.match(await page.textContent("#uncertain"), told);
      assert.deepEqual(faults, []);
      await close();
    }
  });

  test("is under 15 MB at 25 000 triangles, 300 trials, 20 insertions", async (t) => {
    const megabytes = statSync(large).size / kMegabyte;
    assert.ok(megabytes < 15, `${megabytes} MB`);
    // How soon it is usable is told, not tested, since machines differ. The best of some: other
    // programs on the machine only make it slower.
    let best = Infinity;
    for (let k = 0; k < 3; ++k) {
      const {page, faults, seconds, close} = await open(browser, large);
      const drawn = await page.evaluate(() => document.querySelectorAll("#pick-trial option").length);
      assert.equal(drawn, 300);
      assert.deepEqual(faults, []);
      best = Math.min(best, seconds);
      await close();
    }
    t.diagnostic(`${megabytes.toFixed(1)} MB, usable after ${best.toFixed(2)} s (aim: 3 s)`);
  });
}
