// Measures the page: what is loaded, how soon it answers, and its speed beside the desktop program on one thread. Writes docs/web.md.
//   trunk build --release && cargo build --release --no-default-features && node benches/web.mjs
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import zlib from 'node:zlib';
import { browser, host } from '../tests/web/browser.mjs';

const root = path.resolve(import.meta.dirname, '..');
const dist = path.join(root, 'dist');
const native = path.join(root, 'target/release/straightedge');
const data = path.resolve(process.env.STRAIGHTEDGE_DATA ?? path.join(root, '../shared/data'));
const SETS = ['opencv_left', 'learning_opencv_phone', 'udacity_lane', 'plantcv_gopro'];
const RUNS = 5;

const lines = [];
const row = (...cells) => lines.push(`| ${cells.join(' | ')} |`);
const number = (value, digits = 0) => value.toFixed(digits).replace(/\B(?=(\d{3})+(?!\d))/g, ',');
const least = list => Math.min(...list);

// 1. What is loaded.
const files = fs.readdirSync(dist, { recursive: true }).map(f => path.join(dist, f)).filter(f => fs.statSync(f).isFile());
const kinds = [['the program (wasm)', f => f.endsWith('.wasm')], ['all else', () => true]];
const rest = new Set(files), sums = [0, 0, 0];
lines.push('## What is loaded', '');
row('', 'raw', 'gzip -9', 'brotli 11');
row('---', '--:', '--:', '--:');
for (const [name, fits] of kinds) {
  const sizes = [0, 0, 0];
  for (const file of [...rest].filter(fits)) {
    rest.delete(file);
    const bytes = fs.readFileSync(file);
    const quality = { params: { [zlib.constants.BROTLI_PARAM_QUALITY]: 11, [zlib.constants.BROTLI_PARAM_SIZE_HINT]: bytes.length } };
    [bytes.length, zlib.gzipSync(bytes, { level: 9 }).length, zlib.brotliCompressSync(bytes, quality).length].forEach((n, i) => { sizes[i] += n; sums[i] += n; });
  }
  row(name, ...sizes.map(n => number(n)));
}
row('**all**', ...sums.map(n => `**${number(n)}**`));

// 2. How soon it answers: from the start of the navigation to the first picture that hears clicks.
const site = await host(dist);
const first = async (b, query) => {
  const page = await b.open(`${site.url}?seen=1${query}`);
  await page.see('Open folder…');
  const ms = await page.page.evaluate(() => performance.getEntriesByName('first frame')[0].startTime);
  await page.close();
  return ms;
};
const cold = [], warm = [];
for (let i = 0; i < RUNS; i++) {
  const b = await browser();
  cold.push(await first(b, ''));
  warm.push(await first(b, ''));
  await b.close();
}
lines.push('', '## How soon it answers', '', `First frame that hears clicks, from a host on this machine: ${number(least(cold))} ms at the first visit, ${number(least(warm))} ms at the second (least of ${RUNS}).`);

// 3. Beside the desktop program.
lines.push('', '## Speed', '', 'Wall time in ms, least of ' + RUNS + ' runs that took turns: reading and detection summed over the pictures, and the calibration.', '');
row('set', 'pictures', 'read, native', 'read, browser', 'ratio', 'detect, native', 'detect, browser', 'ratio', 'calibrate, native', 'calibrate, browser', 'ratio', 'detect and calibrate', 'with reading');
row('---', ...Array(12).fill('--:'));
for (const set of SETS.filter(set => fs.existsSync(path.join(data, set)))) {
  const folder = path.join(data, set), times = { native: [], web: [] };
  let pictures = 0;
  for (let i = 0; i < RUNS; i++) {
    const report = JSON.parse(execFileSync(native, ['calibrate', folder, '--json', '--threads', '1'], { encoding: 'utf8', maxBuffer: 1 << 28, stdio: ['ignore', 'pipe', 'ignore'] }));
    times.native.push(report.timing_ms);
    pictures = report.frames.length;
    const b = await browser({ script: 'Object.defineProperty(navigator, "hardwareConcurrency", { value: 1 })' });
    const page = await b.open(`${site.url}?seen=1`);
    await page.give('Open folder…', folder);
    // A camera comes with the first pictures: only then is there something to cancel, until all are in.
    await page.see('px RMS fit');
    await page.gone('Cancel', 600000);
    await page.click('Export…');
    await page.click(node => (node.label || node.value) === 'Straightedge JSON');
    times.web.push(JSON.parse((await page.download('Save…')).bytes).timing_ms);
    await b.close();
  }
  const of = (list, part) => least(list.map(t => t[part]));
  const cells = ['read', 'detect', 'calibrate'].flatMap(part => {
    const [n, w] = [of(times.native, part), of(times.web, part)];
    return [number(n, n < 10 ? 1 : 0), number(w, w < 10 ? 1 : 0), (w / n).toFixed(2)];
  });
  const ratio = (...parts) => {
    const sum = list => least(list.map(t => parts.reduce((s, part) => s + t[part], 0)));
    return (sum(times.web) / sum(times.native)).toFixed(2);
  };
  row(set, pictures, ...cells, `**${ratio('detect', 'calibrate')}**`, ratio('read', 'detect', 'calibrate'));
}
const jpegs = folder => fs.readdirSync(folder).filter(f => /\.jpe?g$/i.test(f));

// 4. What the page does meanwhile, and how much memory it takes.
async function meanwhile(from, count, cores = os.cpus().length) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'straightedge-many-'));
  const photographs = jpegs(from);
  for (let i = 0; i < count; i++) fs.copyFileSync(path.join(from, photographs[i % photographs.length]), path.join(folder, `${i}.jpg`));
  const b = await browser({ script: `Object.defineProperty(navigator, "hardwareConcurrency", { value: ${cores} })` });
  const page = await b.open(`${site.url}?seen=1`);
  await page.see('Open folder…');
  await page.page.waitForTimeout(1000);
  await page.page.evaluate(() => {
    window.long = [];
    new PerformanceObserver(list => window.long.push(...list.getEntries().map(e => e.duration))).observe({ type: 'longtask' });
  });
  await page.give('Open folder…', folder);
  await page.see(`of ${count} used`, 600000);
  await page.gone('Cancel', 600000);
  await page.page.waitForTimeout(3000);
  const long = (await page.page.evaluate(() => window.long)).sort((a, b) => b - a);
  // The page and its workers are one process; on Linux the system knows the most that it ever had.
  const peaks = fs.readdirSync('/proc').filter(id => /^\d+$/.test(id)).flatMap(id => {
    try {
      if (!fs.readFileSync(`/proc/${id}/cmdline`, 'utf8').includes('--type=renderer')) return [];
      return [+/VmHWM:\s+(\d+)/.exec(fs.readFileSync(`/proc/${id}/status`, 'utf8'))[1] / 1024];
    } catch { return []; }
  });
  await b.close();
  fs.rmSync(folder, { recursive: true });
  return { long, peak: Math.max(...peaks) };
}
// The photographs of a folder, made larger by a browser: there is no set of 12 megapixels.
async function twelveMegapixels(from) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'straightedge-large-'));
  const b = await browser();
  const page = await b.context.newPage();
  for (const name of jpegs(from)) {
    const made = await page.evaluate(async base64 => {
      const small = await createImageBitmap(await (await fetch(`data:image/jpeg;base64,${base64}`)).blob());
      const canvas = new OffscreenCanvas(4243, 2828);
      canvas.getContext('2d').drawImage(small, 0, 0, canvas.width, canvas.height);
      const bytes = new Uint8Array(await (await canvas.convertToBlob({ type: 'image/jpeg', quality: 0.95 })).arrayBuffer());
      return Array.from({ length: Math.ceil(bytes.length / 3e4) }, (_, i) => btoa(String.fromCharCode(...bytes.subarray(3e4 * i, 3e4 * (i + 1))))).join('');
    }, fs.readFileSync(path.join(from, name), 'base64'));
    fs.writeFileSync(path.join(folder, name), Buffer.from(made, 'base64'));
  }
  await b.close();
  return folder;
}
if (fs.existsSync(path.join(data, 'udacity_lane'))) {
  const long = [];
  for (let i = 0; i < RUNS; i++) long.push(...(await meanwhile(path.join(data, 'udacity_lane'), 50)).long);
  lines.push('', '## The page meanwhile', '', `Tasks of the page above 50 ms while 50 photographs are read, detected and solved, in ${RUNS} runs: ${long.length}${long.length ? ` (${long.map(ms => number(ms)).join(', ')} ms)` : ''}.`);
}
if (fs.existsSync(path.join(data, 'plantcv_gopro')) && fs.existsSync('/proc/self/status')) {
  const large = await twelveMegapixels(path.join(data, 'plantcv_gopro'));
  const peaks = [];
  for (const cores of [2, 8]) peaks.push((await meanwhile(large, 100, cores)).peak);
  fs.rmSync(large, { recursive: true });
  lines.push('', `Most memory of the page with its workers while 100 photographs of 12 megapixels go through it: ${number(peaks[0])} MB on 2 processors, ${number(peaks[1])} MB on 8, where there are six workers.`);
}
site.close();
const chromium = execFileSync(process.env.CHROMIUM ?? '/usr/bin/chromium', ['--version'], { encoding: 'utf8' }).trim();
const head = `# The page, measured\n\nWritten by \`node benches/web.mjs\` (its head says what to build before) on ${os.cpus()[0].model}, ${chromium}, WebGL by SwiftShader, ${new Date().toISOString().slice(0, 10)}. The browser's pictures go through one worker, the desktop program runs with \`--threads 1\`.\n\n`;
fs.writeFileSync(path.join(root, 'docs/web.md'), head + lines.join('\n') + '\n');
console.log(lines.join('\n'));
