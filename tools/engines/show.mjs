// show.mjs CHROMIUM GLB PICTURE: open page.html with a .glb in a headless Chromium that draws in software, keep a
// picture of it, and print as JSON what the page measured.
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const [program, glb, picture] = process.argv.slice(2);
const HERE = fileURLToPath(new URL(".", import.meta.url));
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript" };
const FLAGS = [
  "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
  "--disable-component-update", "--no-first-run", "--hide-scrollbars",
];

const server = createServer(async (request, response) => {
  const path = normalize(new URL(request.url, "http://localhost").pathname);
  try {
    const body = await readFile(path === "/model.glb" ? glb : join(HERE, path));
    response.writeHead(200, { "Content-Type": TYPES[extname(path)] ?? "application/octet-stream" }).end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));

const browser = await chromium.launch({ executablePath: program, headless: true, args: FLAGS });
try {
  const page = await browser.newPage({ viewport: { width: 1120, height: 460 } });
  const troubles = [];
  page.on("pageerror", (error) => troubles.push(String(error)));
  page.on("console", (message) => message.type() === "error" && troubles.push(message.text()));
  page.on("response", (response) => response.ok() || troubles.push(`${response.status()} ${response.url()}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/page.html`);
  await page.waitForFunction(() => window.ready, undefined, { timeout: 60000 });
  const meshes = await page.evaluate(() => window.load("/model.glb"));
  await page.evaluate(() => window.draw());
  await page.screenshot({ path: picture });
  const pixels = await page.evaluate(() => window.measure());
  process.stdout.write(JSON.stringify({ meshes, pixels, troubles }));
} finally {
  await browser.close();
  server.close();
}
