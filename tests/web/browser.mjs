// A static host, a Chromium, and eyes and hands for the page: what `window.seen()` tells, and real clicks.
import { createRequire } from 'node:module';
import fs from 'node:fs';
import http from 'node:http';
import os from 'node:os';
import path from 'node:path';

const tools = process.env.WASM_TOOLS ?? path.join(os.homedir(), '.local/wasm-tools');
const { chromium } = createRequire(tools + '/')('playwright-core');

const KINDS = {
  '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm', '.css': 'text/css', '.svg': 'image/svg+xml',
  '.png': 'image/png', '.webmanifest': 'application/manifest+json',
};

// Serves a folder as a plain host does, below a sub-path; `down` refuses everything.
export async function host(root) {
  const state = { down: false, root };
  const server = http.createServer((asked, answer) => {
    if (state.down) return asked.socket.destroy();
    let file = decodeURIComponent(new URL(asked.url, 'http://x').pathname);
    if (!file.startsWith('/app/')) return answer.writeHead(404).end();
    file = path.join(state.root, file.slice(4));
    if (file.endsWith('/')) file += 'index.html';
    if (!file.startsWith(state.root) || !fs.existsSync(file)) return answer.writeHead(404).end();
    const { size, mtimeMs } = fs.statSync(file);
    const etag = `"${size}-${mtimeMs}"`;
    const head = { 'content-type': KINDS[path.extname(file)] ?? 'application/octet-stream', etag, 'cache-control': 'max-age=600' };
    if (asked.headers['if-none-match'] === etag) return answer.writeHead(304, head).end();
    answer.writeHead(200, { ...head, 'content-length': size });
    fs.createReadStream(file).pipe(answer);
  }).listen(0, '127.0.0.1');
  await new Promise(done => server.once('listening', done));
  state.url = `http://127.0.0.1:${server.address().port}/app/`;
  state.close = () => { server.closeAllConnections(); server.close(); };
  return state;
}

// A browser with an empty profile. `log` has everything that went wrong in any page, `asked` every address that was asked for.
export async function browser({ width = 1280, height = 800, scale = 1, touch = false, script } = {}) {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'straightedge-'));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', headless: false, chromiumSandbox: false, timeout: 120000,
    viewport: scale === 1 ? { width, height } : null, hasTouch: touch, acceptDownloads: true,
    args: [`--force-device-scale-factor=${scale}`, '--headless=new', '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
      '--disable-sync', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--enable-precise-memory-info'],
  });
  const log = [], asked = [];
  if (script) await context.addInitScript(script);
  context.on('request', request => asked.push(request.url()));
  const close = async () => { await context.close(); fs.rmSync(profile, { recursive: true, force: true }); };
  // Emulated dense pixels do not reach what tells a page how many a canvas has: the screen itself is dense, and only its size emulated.
  const dense = async page => {
    if (scale === 1) return;
    const client = await context.newCDPSession(page);
    await client.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 0, mobile: touch });
  };
  return { context, log, asked, close, open: url => Page.open(context, url, log, dense) };
}

const words = node => node.label || node.value;

export class Page {
  static async open(context, url, log, prepare) {
    const page = await context.newPage();
    await prepare(page);
    page.setDefaultTimeout(120000);
    page.on('console', message => { if (['error', 'warning'].includes(message.type())) log.push(`${message.type()}: ${message.text()}`); });
    page.on('pageerror', error => log.push(`pageerror: ${error}`));
    page.on('requestfailed', request => log.push(`requestfailed: ${request.url()} ${request.failure()?.errorText}`));
    await page.goto(url);
    return new Page(page);
  }

  constructor(page) { this.page = page; }

  // What is on the screen: [{ role, label, value, on, disabled, x, y, w, h }].
  async nodes() {
    return this.page.evaluate(() => window.seen ? JSON.parse(window.seen()).nodes : []);
  }

  // The first node that `wanted` accepts, waited for. A text is looked for in labels and values.
  async see(wanted, ms = 60000) {
    const fits = typeof wanted === 'string' ? node => words(node).includes(wanted) : wanted;
    const end = Date.now() + ms;
    for (;;) {
      const nodes = await this.nodes();
      const found = nodes.find(fits);
      if (found) return found;
      if (Date.now() > end) await this.tell(new Error(`not seen: ${wanted}`));
      await this.page.waitForTimeout(50);
    }
  }

  // Throws the error with what is on the screen.
  async tell(error) {
    const seen = (await this.nodes()).map(words).filter(Boolean).join(' | ').slice(0, 4000);
    throw new Error(`${error.message}\non the screen: ${seen}`);
  }

  async gone(text, ms = 60000) {
    const end = Date.now() + ms;
    while ((await this.nodes()).some(node => words(node).includes(text))) {
      if (Date.now() > end) throw new Error(`still there: ${text}`);
      await this.page.waitForTimeout(50);
    }
  }

  // Clicks the middle of a button, or of what `wanted` accepts.
  async click(wanted) {
    const fits = typeof wanted === 'string' ? node => node.role.includes('Button') && !node.disabled && words(node) === wanted : wanted;
    const { x, y, w, h } = await this.see(fits);
    await this.page.mouse.click(x + w / 2, y + h / 2);
  }

  // Clicks and answers the file that is downloaded: { name, path, bytes }.
  async download(wanted) {
    const [download] = await Promise.all([this.page.waitForEvent('download').catch(error => this.tell(error)), this.click(wanted)]);
    const file = await download.path();
    return { name: download.suggestedFilename(), path: file, bytes: fs.readFileSync(file) };
  }

  // Gives files, or a folder, to the dialog that a click opens.
  async give(wanted, files) {
    const [chooser] = await Promise.all([this.page.waitForEvent('filechooser').catch(error => this.tell(error)), this.click(wanted)]);
    await chooser.setFiles(files);
  }

  // Drops files on the page, as from the desktop: [[name, bytes or text]].
  async drop(files) {
    const given = files.map(([name, bytes]) => [name, Buffer.from(bytes).toString('base64')]);
    await this.page.evaluate(given => {
      const transfer = new DataTransfer();
      for (const [name, bytes] of given) transfer.items.add(new File([Uint8Array.from(atob(bytes), c => c.charCodeAt(0))], name));
      document.querySelector('canvas').dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
    }, given);
  }

  // Waits until nothing moves any more: a dialog still grows while it opens.
  async still() {
    for (let last, same = 0; same < 3;) {
      const now = await this.page.evaluate(() => window.seen());
      same = now === last ? same + 1 : 0;
      last = now;
      await this.page.waitForTimeout(100);
    }
  }

  // Takes a picture of what does not move any more.
  async picture(file) {
    await this.still();
    return this.page.screenshot(file ? { path: file } : {});
  }

  close() { return this.page.close(); }
}

// Share of pixels in which two PNGs differ by more than `step` levels, found by a browser; 1 where their sizes differ.
export async function differing(context, one, other, step = 24) {
  const page = await context.newPage();
  try {
    return await page.evaluate(async ([one, other, step]) => {
      const pixels = async data => {
        const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
        const canvas = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
        canvas.drawImage(bitmap, 0, 0);
        return canvas.getImageData(0, 0, bitmap.width, bitmap.height);
      };
      const [a, b] = [await pixels(one), await pixels(other)];
      if (a.width !== b.width || a.height !== b.height) return 1;
      let count = 0;
      for (let i = 0; i < a.data.length; i += 4) {
        if ([0, 1, 2].some(c => Math.abs(a.data[i + c] - b.data[i + c]) > step)) count++;
      }
      return 4 * count / a.data.length;
    }, [one.toString('base64'), other.toString('base64'), step]);
  } finally { await page.close(); }
}
