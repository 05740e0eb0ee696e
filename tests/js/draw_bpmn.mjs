// Draws BPMN files as SVG, as bpmn-js shows them, in a headless Chromium.
// node draw_bpmn.mjs FOLDER FILE...   writes FOLDER/<name of FILE>.svg for each
//
// Each picture says which file it was drawn from and the file's SHA-256, so that a stale one is found.
import { createHash } from 'node:crypto';
import { readFile, writeFile } from 'node:fs/promises';
import { basename, join } from 'node:path';

import { evaluate } from './chromium.mjs';

const VIEWER = new URL('node_modules/bpmn-js/dist/bpmn-viewer.production.min.js', import.meta.url);

const draw = (xml) => evaluate(VIEWER, async (text) => {
  const viewer = new BpmnJS({ container: '#canvas' });
  const { warnings } = await viewer.importXML(text);
  const { svg } = await viewer.saveSVG();
  return { svg, warnings: warnings.map(({ message }) => message) };
}, xml);

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
