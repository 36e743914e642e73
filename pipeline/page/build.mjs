// node build.mjs OUT: bundles src/ and the libraries into the one file OUT/template.html, and puts
// it into OUT/page_template.h for the C++ program. The program fills %WIREPLAN_...% with data.
import {readFileSync, writeFileSync, existsSync} from "node:fs";
import {dirname, join} from "node:path";
import {fileURLToPath} from "node:url";
import {build} from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2];

const bundle = async (entry, options) => {
  const result = await build({
    entryPoints: [join(here, "src", entry)],
    bundle: true,
    minify: true,
    write: false,
    metafile: true,
    legalComments: "none",
    charset: "ascii",
    target: ["es2020"],
    logLevel: "warning",
    ...options,
  });
  return {text: result.outputFiles[0].text.trim(), inputs: Object.keys(result.metafile.inputs)};
};

// The licence texts of the packages that went into the bundle, equal ones once.
const licences = (inputs) => {
  const packages = new Set();
  for (const input of inputs) {
    const found = input.match(/node_modules\/((?:@[^/]+\/)?[^/]+)\//);
    if (found) packages.add(found[1]);
  }
  const byText = new Map();
  for (const name of [...packages].sort()) {
    const folder = join(here, "node_modules", name);
    const {version, license} = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
    const file = ["LICENSE", "LICENSE.md", "LICENSE.txt"].find((f) => existsSync(join(folder, f)));
    const text = file ? readFileSync(join(folder, file), "utf8").trim() : `Licence: ${license}`;
    byText.set(text, [...(byText.get(text) ?? []), `${name} ${version}`]);
  }
  return [...byText].map(([text, names]) => `${names.join(", ")}\n\n${text}`).join("\n\n----\n\n");
};

const escapeHtml = (text) =>
  text.replace(/[&<>]/g, (c) => ({"&": "&amp;", "<": "&lt;", ">": "&gt;"})[c]);

const script = await bundle("main.js", {format: "iife"});
const style = await bundle("style.css", {});
const parts = {
  SCRIPT: script.text,
  STYLE: style.text,
  LICENCES: escapeHtml(licences(script.inputs)),
};
let html = readFileSync(join(here, "src", "index.html"), "utf8");
for (const [name, text] of Object.entries(parts)) {
  html = html.replace(`%BUILD_${name}%`, () => text);
}
if (html.includes(')page"')) throw new Error("the template holds the end of its C++ literal");
writeFileSync(join(out, "template.html"), html);
writeFileSync(
  join(out, "page_template.h"),
  `#pragma once
#pragma GCC diagnostic ignored "-Woverlength-strings"
inline constexpr const char* kPageTemplate = R"page(${html})page";
inline constexpr const char* kPageMissing = "";
`,
);
