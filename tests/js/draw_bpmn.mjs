// Draws BPMN files as SVG, as bpmn-js shows them, in a headless Chromium.
// node draw_bpmn.mjs FOLDER FILE...   writes FOLDER/<name of FILE>.svg for each
//
// Each picture says which file it was drawn from and the file's SHA-256, so that a stale one is found.
import { execFile } from 'node:child_process';
import { createHash } from 'node:crypto';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { promisify } from 'node:util';

const VIEWER = new URL('node_modules/bpmn-js/dist/bpmn-viewer.production.min.js', import.meta.url);
const BROWSERS = process.env.CHROMIUM
  ? [process.env.CHROMIUM]
  : ['chromium', 'chromium-browser', 'google-chrome'];
// Root has no sandbox. What is drawn is all in the page: nothing is to be asked of any host.
const OPTIONS = [
  ...(process.getuid?.() === 0 ? ['--no-sandbox'] : []),
  '--headless', '--disable-gpu', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--host-resolver-rules=MAP * ~NOTFOUND',
  '--virtual-time-budget=30000',
];
const TIMEOUT_MS = 60_000;

const run = promisify(execFile);

const page = (xml) => `<!DOCTYPE html>
<meta charset="utf-8">
<div id="canvas" style="width: 2400px; height: 2400px"></div>
<pre id="result"></pre>
<script src="${VIEWER}"></script>
<script>
  const tell = (result) => {
    const bytes = new TextEncoder().encode(JSON.stringify(result));
    document.getElementById('result').textContent = Array.from(bytes, (b) =>
      b.toString(16).padStart(2, '0')).join('');
    document.getElementById('canvas').remove();
  };
  const viewer = new BpmnJS({ container: '#canvas' });
  viewer.importXML(${JSON.stringify(xml).replaceAll('<', '\\u003c')})
    .then(async ({ warnings }) => {
      const { svg } = await viewer.saveSVG();
      tell({ svg, warnings: warnings.map(({ message }) => message) });
    })
    .catch((error) => tell({ svg: '', warnings: [String(error)] }));
</script>`;

async function browse(args) {
  for (const browser of BROWSERS) {
    try {
      return await run(browser, args, { maxBuffer: 2 ** 26, timeout: TIMEOUT_MS });
    } catch (error) {
      if (error.code !== 'ENOENT') throw error;
    }
  }
  throw new Error(`needs a Chromium: none of ${BROWSERS.join(', ')} is there`);
}

async function draw(xml) {
  const folder = await mkdtemp(join(tmpdir(), 'draw-bpmn-'));
  try {
    const file = join(folder, 'page.html');
    await writeFile(file, page(xml));
    const { stdout } = await browse([
      ...OPTIONS, `--user-data-dir=${join(folder, 'profile')}`, '--dump-dom', `file://${file}`,
    ]);
    const [, hex] = stdout.match(/<pre id="result">([0-9a-f]*)<\/pre>/) ?? [];
    if (!hex) throw new Error('the browser drew nothing');
    return JSON.parse(Buffer.from(hex, 'hex').toString('utf8'));
  } finally {
    await rm(folder, { recursive: true, force: true, maxRetries: 5 });
  }
}

// bpmn-js names its arrow heads at random; a picture is to change only when the mission does.
function steady(svg) {
  const names = new Map();
  return svg.replace(/marker-[0-9a-z]{20,}/g, (name) => {
    if (!names.has(name)) names.set(name, `marker-${names.size + 1}`);
    return names.get(name);
  });
}

function finished(svg, file, xml) {
  const hash = createHash('sha256').update(xml).digest('hex');
  const source = `<metadata>Drawn from ${basename(file)}, SHA-256 ${hash}</metadata>`;
  const [head, box] = svg.match(/<svg [^>]*viewBox="([^"]*)"[^>]*>/);
  const [x, y, width, height] = box.split(' ');
  const paper = `<rect x="${x}" y="${y}" width="${width}" height="${height}" fill="white"/>`;
  return `${steady(svg.replace(head, `${head}\n${source}\n${paper}`)).trimEnd()}\n`;
}

const [folder, ...files] = process.argv.slice(2);
for (const file of files) {
  const xml = await readFile(file);
  const { svg, warnings } = await draw(xml.toString('utf8'));
  if (warnings.length) throw new Error(`${file}: ${warnings.join('; ')}`);
  await writeFile(join(folder, `${basename(file, '.bpmn')}.svg`), finished(svg, file, xml));
}
