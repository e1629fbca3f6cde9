// Bundles the page into one file: node build.mjs [FILE]. The same sources give the same bytes.

import { readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const assets = join(here, "..", "src", "quadstep", "page", "assets");

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

const script = await bundle("src/main.ts", { format: "iife" });
const style = await bundle("src/style/page.css", { loader: { ".woff2": "dataurl" } });
let page = readFileSync(join(here, "page.template.html"), "utf8");
page = insert(page, "/*STYLE*/", style.replaceAll("</", "<\\/"));
page = insert(page, "/*SCRIPT*/", script.replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--"));
for (const line of ["<title>quadstep</title>", '<script id="quadstep-data" type="application/json">{}</script>', '<script id="quadstep-laws">0</script>']) {
  if (page.split(line).length !== 2) throw new Error(`the page must hold ${line} exactly once`);
}

const licences = [
  ["three", "three.js", "LICENSE"],
  ["@fontsource-variable/inter", "Inter (typeface)", "LICENSE"],
].map(([name, title, file]) => {
  const folder = join(here, "node_modules", name);
  const { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  return `${title} ${version} (${license}), from the package ${name}\n\n${readFileSync(join(folder, file), "utf8").trim()}\n`;
});

const out = process.argv[2] ?? assets;
writeFileSync(join(out, "page.html"), page);
writeFileSync(join(out, "LICENSES.txt"), `page.html holds parts of:\n\n${licences.join(`\n${"-".repeat(80)}\n\n`)}`);
console.log(`page.html: ${(Buffer.byteLength(page) / 1e6).toFixed(2)} MB`);
