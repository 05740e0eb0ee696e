// Runs code in a page of a headless Chromium and returns its result.
import { execFile } from 'node:child_process';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { promisify } from 'node:util';

const BROWSERS = process.env.CHROMIUM
  ? [process.env.CHROMIUM]
  : ['chromium-headless-shell', 'chromium', 'chromium-browser', 'google-chrome'];
// Root has no sandbox. What is drawn is all in the page: nothing is to be asked of any host.
const OPTIONS = [
  ...(process.getuid?.() === 0 ? ['--no-sandbox'] : []),
  '--headless', '--disable-gpu', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--host-resolver-rules=MAP * ~NOTFOUND',
  '--virtual-time-budget=30000',
];
const TIMEOUT_MS = 60_000;

const run = promisify(execFile);

// The result is written as hexadecimal digits: `--dump-dom` would escape its text.
const page = (library, code, argument) => `<!DOCTYPE html>
<meta charset="utf-8">
<div id="canvas" style="width: 2400px; height: 2400px"></div>
<div id="panel"></div>
<pre id="result"></pre>
<script src="${library}"></script>
<script>
  (${code})(${JSON.stringify(argument).replaceAll('<', '\\u003c')})
    .catch((error) => ({ error: String(error?.stack ?? error) }))
    .then((result) => {
      const bytes = new TextEncoder().encode(JSON.stringify(result));
      document.getElementById('result').textContent = Array.from(bytes, (b) =>
        b.toString(16).padStart(2, '0')).join('');
      document.getElementById('canvas').remove();
    });
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

// Loads `library`, a URL, into a page with the elements #canvas and #panel, and awaits `code`, an
// asynchronous function, with `argument`. Argument and result are JSON; an error of it is thrown.
export async function evaluate(library, code, argument) {
  const folder = await mkdtemp(join(tmpdir(), 'm2pem-chromium-'));
  try {
    const file = join(folder, 'page.html');
    await writeFile(file, page(library, code, argument));
    const { stdout } = await browse([
      ...OPTIONS, `--user-data-dir=${join(folder, 'profile')}`, '--dump-dom', `file://${file}`,
    ]);
    const [, hex] = stdout.match(/<pre id="result">([0-9a-f]*)<\/pre>/) ?? [];
    if (!hex) throw new Error('the browser gave no result');
    const result = JSON.parse(Buffer.from(hex, 'hex').toString('utf8'));
    if (result.error) throw new Error(result.error);
    return result;
  } finally {
    await rm(folder, { recursive: true, force: true, maxRetries: 5 });
  }
}
