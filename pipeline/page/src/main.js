// report.html: puts the sections together.
import {el} from "./dom.js";
import {readPage, readReport} from "./data.js";
import {shown} from "./format.js";
import {makeSelection} from "./selection.js";
import {anatomySection} from "./anatomy.js";
import {showOverview} from "./overview.js";
import {sheetSection, verdictSection} from "./sheet.js";
import {answerSection, askedSection, catheterSection, motionSection, provenanceSection, uncertainSection, warningSection} from "./texts.js";
import {rankingSection} from "./ranking.js";
import {vesselSection} from "./player.js";
import {heatSection} from "./heatmap.js";
import {chartSection} from "./charts.js";
import {sliceSection} from "./slices.js";

const showReport = () => {
  const page = readPage();
  const first = page.report.ranking[0]?.trial ?? page.insertions.keys().next().value ?? 0;
  const selection = makeSelection(first);
  document.title = `${shown(page.report.name)}: wireplan report`;

  const notice = () => el("p", {class: "notice"}, el("strong", {}, page.report.statement));
  const vessel = vesselSection(page, selection);
  const sheet = sheetSection(page);
  const sections = [
    verdictSection(page),
    answerSection(page),
    askedSection(page),
    rankingSection(page, selection),
    catheterSection(page),
    vessel.node,
    heatSection(page, selection),
    chartSection(page, selection),
    anatomySection(page),
    motionSection(page),
    uncertainSection(page),
    sliceSection(page),
    warningSection(page),
    provenanceSection(page),
  ].filter(Boolean);
  // By itself first: laying it out takes no time then.
  const main = document.getElementById("page");
  main.append(sheet.node);
  sheet.fit();
  main.append(
    el("header", {},
      notice(),
      el("nav", {"aria-label": "Contents"},
        el("ul", {}, sections.map((s) => el("li", {}, el("a", {href: `#${s.id}`}, s.querySelector("h2").textContent)))))),
    ...sections,
    notice());
  vessel.start();
};

const report = readReport();
if (report.schema.startsWith("wireplan.overview/")) showOverview(report);
else showReport();
// For who waits until the page can be used.
document.documentElement.dataset.ready = "true";
