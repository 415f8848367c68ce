// Bundles the viewer of the report: node build.mjs [FILE]. Without FILE it writes ../report_viewer.js, which is
// committed and shipped, so that users need no Node. Needs `npm ci` beside it first; `make viewer` does both in
// a folder of its own.
import { readFile } from "node:fs/promises";
import { build } from "esbuild";

const here = new URL(".", import.meta.url);
const { version } = JSON.parse(await readFile(new URL("node_modules/three/package.json", here), "utf8"));
const licence = (await readFile(new URL("node_modules/three/LICENSE", here), "utf8")).trim();

await build({
  absWorkingDir: here.pathname,
  entryPoints: ["src/main.js"],
  outfile: process.argv[2] ?? "../report_viewer.js",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2020",
  charset: "utf8",
  legalComments: "none",
  banner: {
    js: `/* The viewer of Metal Blossom's report (Apache-2.0), built by studio/viewer/build.mjs.\n`
      + `   It contains three.js ${version}:\n\n${licence.replace(/^/gm, "   ").replace(/ +$/gm, "")}\n*/`,
  },
});
