// Bundles page and article, each into one file: node build.mjs [FOLDER]. The same sources give the same bytes.

import { readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const assets = join(here, "..", "src", "quadstep", "page", "assets");
const reports = join(here, "..", "src", "quadstep", "report");
const fonts = join(reports, "fonts");

async function bundle(entry, options) {
  const result = await build({
    absWorkingDir: here,
    entryPoints: [entry],
    bundle: true,
    minify: true,
    write: false,
    charset: "utf8",
    legalComments: "none",
    target: ["chrome110", "firefox115", "safari16.4"],
    logLevel: "warning",
    ...options,
  });
  if (result.warnings.length) throw new Error(`${entry}: ${result.warnings.length} warnings`);
  return result.outputFiles[0].text.trim();
}

/** Puts text where a marker stands, once. */
function insert(page, marker, text) {
  const parts = page.split(marker);
  if (parts.length !== 2) throw new Error(`the template must hold ${marker} once, not ${parts.length - 1} times`);
  return parts.join(text);
}

/** A page of its template, script and style, with the places that Python fills. */
async function page(template, script, style, places, scene) {
  let text = readFileSync(join(here, template), "utf8");
  text = insert(text, "/*STYLE*/", (await bundle(style, { loader: { ".woff2": "dataurl" } })).replaceAll("</", "<\\/"));
  const inserted = async (entry, options) => (await bundle(entry, { format: "iife", ...options })).replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--");
  text = insert(text, "/*SCRIPT*/", await inserted(script));
  if (scene) text = insert(text, "/*SCENE*/", await inserted(scene, { globalName: "quadstepScene" }));
  for (const line of places) if (text.split(line).length !== 2) throw new Error(`${template} must hold ${line} exactly once`);
  return text;
}

const PLACES = ["<title>quadstep</title>", '<script id="quadstep-data" type="application/json">{}</script>', '<script id="quadstep-laws">0</script>'];
const pages = {
  "page.html": await page("page.template.html", "src/main.ts", "src/style/page.css", PLACES, "src/scene/view.ts"),
  "report.js": (await bundle("src/report/main.ts", { format: "iife" })).replaceAll("</script", "<\\/script"),
  "article.html": await page("article.template.html", "src/article/main.ts", "src/article/article.css", [...PLACES, "<!--ARTICLE-->"]),
};

const three = join(here, "node_modules", "three");
const { version, license } = JSON.parse(readFileSync(join(three, "package.json"), "utf8"));
const licences = [
  `three.js ${version} (${license}), from the package three\n\n${readFileSync(join(three, "LICENSE"), "utf8").trim()}\n`,
  readFileSync(join(fonts, "LICENSES.txt"), "utf8"),
];

for (const [name, text] of Object.entries(pages)) {
  writeFileSync(join(process.argv[2] ?? (name === "report.js" ? reports : assets), name), text);
  console.log(`${name}: ${(Buffer.byteLength(text) / 1e6).toFixed(2)} MB`);
}
writeFileSync(join(process.argv[2] ?? assets, "LICENSES.txt"), `page.html and article.html hold parts of:\n\n${licences.join(`\n${"-".repeat(80)}\n\n`)}`);
