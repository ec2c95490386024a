// The page as a user meets it, in a real browser: run by ./test after `trunk build --release`.
//   DIST       the built page                     (dist)
//   NATIVE     the desktop program, to compare    (target/debug/straightedge)
//   STRAIGHTEDGE_DATA   real photographs; what needs them is skipped without
//   UPDATE_SNAPSHOTS=1  accepts the pictures of this run
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { browser, differing, host } from './browser.mjs';

const here = import.meta.dirname;
const root = path.resolve(here, '../..');
const dist = path.resolve(process.env.DIST ?? path.join(root, 'dist'));
const native = path.resolve(process.env.NATIVE ?? path.join(root, 'target/debug/straightedge'));
const data = path.resolve(process.env.STRAIGHTEDGE_DATA ?? path.join(root, '../shared/data'));
const left = path.join(data, 'opencv_left');
const photographs = fs.existsSync(left) ? {} : { skip: `no photographs in ${data}` };
const jpegs = () => fs.readdirSync(left).filter(f => f.endsWith('.jpg'));
// A window that shows the whole list of pictures, also those at its end that are set aside.
const tall = { ...photographs, height: 2000 };
const scratch = fs.mkdtempSync(path.join(os.tmpdir(), 'straightedge-test-'));

let site;
before(async () => { site = await host(dist); });
after(() => { site.close(); fs.rmSync(scratch, { recursive: true, force: true }); });

// A test in a browser of its own: at its end nothing has gone wrong in the console and nothing was asked of another host.
function inBrowser(name, options, run) {
  test(name, { timeout: 300000, ...options }, async () => {
    const b = await browser(options);
    try {
      await run(b);
      assert.deepEqual(b.log.filter(line => !(options.expected ?? []).some(e => line.includes(e))), [], 'console');
      assert.deepEqual(b.asked.filter(url => !url.startsWith(site.url) && !/^(blob|data):/.test(url)), [], 'foreign requests');
    } finally { await b.close(); }
  });
}

const address = query => `${site.url}?seen=1&${query}`;
const solved = page => page.see(node => /^\d+(\.\d+)? px RMS fit$/.test(words(node)), 120000);
const idle = page => page.gone('Cancel', 120000);

// A folder with every photograph several times.
function copies(name, count) {
  const folder = path.join(scratch, name);
  fs.mkdirSync(folder);
  for (let copy = 0; copy < count; copy++) {
    for (const f of jpegs()) fs.copyFileSync(path.join(left, f), path.join(folder, `${copy} ${f}`));
  }
  return folder;
}

// The picture of a page beside the accepted one.
async function looks(b, page, name) {
  const picture = await page.picture(path.join(scratch, `${name}.png`));
  const accepted = path.join(here, 'snapshots', `${name}.png`);
  if (process.env.UPDATE_SNAPSHOTS) {
    fs.mkdirSync(path.dirname(accepted), { recursive: true });
    return fs.writeFileSync(accepted, picture);
  }
  const share = await differing(b.context, picture, fs.readFileSync(accepted));
  if (share > 0.002) fs.copyFileSync(path.join(scratch, `${name}.png`), path.join(here, 'snapshots', `${name}.new.png`));
  assert.ok(share <= 0.002, `${name} looks different: ${(100 * share).toFixed(2)} % of its pixels (${name}.new.png)`);
}

// The whole result, through the export dialog.
async function exported(page) {
  await page.click('Export…');
  await page.still();
  await page.click(node => words(node) === 'Straightedge JSON');
  await page.still();
  const file = await page.download('Save…');
  await page.click('Close');
  return file;
}
const words = node => node.label || node.value;

function run(...args) {
  return JSON.parse(execFileSync(native, args, { maxBuffer: 1 << 28, encoding: 'utf8' }));
}

inBrowser('the empty page', {}, async b => {
  const page = await b.open(address('theme=dark'));
  await page.see('Drop a folder of board pictures here');
  await looks(b, page, 'empty');
});

inBrowser('the demo', {}, async b => {
  const page = await b.open(address('demo=seed&theme=dark'));
  await solved(page);
  await page.see('of 15 used');
  await idle(page);
  await looks(b, page, 'demo');
  const camera = JSON.parse((await exported(page)).bytes);
  assert.equal(camera.frames.length, 15);
});

inBrowser('address: a view and the light theme', {}, async b => {
  const page = await b.open(address('demo=seed&view=errors&theme=light'));
  await solved(page);
  await idle(page);
  await looks(b, page, 'errors_light');
});

inBrowser('sources of error, an earlier calibration, a twin', {}, async b => {
  const page = await b.open(address('demo=seed&view=errors&theme=dark'));
  await solved(page);
  await idle(page);
  await page.click(node => words(node) === 'Sources');
  await page.see('Corner detection and localisation');
  await page.still();
  await looks(b, page, 'sources');
  const report = JSON.parse((await exported(page)).bytes);
  assert.equal(report.sources.cards.length, 7);
  assert.equal(report.verdict.level, 'good');
  assert.ok(report.findings.every(f => f.title && f.text));
  // The same camera, 2 px longer.
  for (const camera of [report, ...report.cameras]) camera.camera_matrix.fx += 2, camera.camera_matrix.fy += 2;
  await page.drop([['earlier.json', JSON.stringify(report)]]);
  await page.see('How far points move (RMS)');
  // Held against the pictures by a worker.
  await page.see('No longer valid: the focal length moved by');
  await page.gone('is in your downloads');
  await page.still();
  await looks(b, page, 'compare');
  const shorter = JSON.stringify(report, (name, value) => (name === 'fx' || name === 'fy') && value > 900 ? value - 3 : value);
  await page.drop([['later.json', JSON.stringify(report) + ' '], ['last.json', shorter]]);
  await page.see('last.json');
  await page.see('2 of 3 differ from it by more than chance');
  await page.click('Close last.json');
  await page.gone('last.json');
  await page.click(node => words(node) === 'earlier.json');
  await page.see('How far points move (RMS)');
  await page.click('Menu');
  await page.click('Lab');
  await page.click(node => words(node) === 'Twin');
  await page.click('Draw it 30 times');
  await page.see(node => words(node) === 'your σ', 240000);
  await page.still();
  await looks(b, page, 'twin');
});

inBrowser('photographs: calibrated, exported, the same as the desktop program', photographs, async b => {
  const page = await b.open(address('theme=dark'));
  await page.give('Open folder…', left);
  await solved(page);
  await idle(page);
  const file = await exported(page);
  assert.equal(file.name, 'camera.json');
  const report = JSON.parse(file.bytes);
  const copy = path.join(scratch, 'page.json');
  fs.writeFileSync(copy, file.bytes);
  // From the same corners: the same numbers.
  const same = run('calibrate', '--corners', copy, '--json');
  sameCamera(report, same, value => 1e-9 * Math.max(Math.abs(value), 1));
  near(report.sigma, same.sigma, value => 1e-9 * Math.max(Math.abs(value), 1));
  // The whole job, from the photographs: the same within a thousandth of σ.
  const whole = run('calibrate', left, '--json');
  assert.deepEqual(report.frames.map(f => f.corners.length), whole.frames.map(f => f.corners.length));
  sameCamera(report, whole, (_, at) => 1e-3 * (whole.sigma[at] ?? 0) + 1e-9);
});

// Lenses and boards that are not the usual ones come out by themselves, as on the desktop.
for (const [set, title, options] of [
  ['camodocal_fisheye', 'Fisheye, Kannala–Brandt', ['--model', 'kb4']],
  ['caliscope_charuco', 'ChArUco 4 × 5', []],
  ['opencv_circles', 'Circles', []],
]) {
  const folder = path.join(data, set);
  const there = fs.existsSync(folder) ? {} : { skip: `no photographs in ${folder}` };
  inBrowser(`${set}: found by itself, the same as the desktop program`, there, async b => {
    const page = await b.open(address('theme=dark'));
    await page.give('Open folder…', folder);
    await solved(page);
    await page.see(node => words(node)?.includes(title));
    await idle(page);
    const report = JSON.parse((await exported(page)).bytes);
    const same = run('calibrate', folder, ...options, '--json');
    assert.equal(report.model, same.model);
    assert.deepEqual(report.frames.map(f => f.corners.length), same.frames.map(f => f.corners.length));
    sameCamera(report, same, (_, at) => 1e-3 * (same.sigma[at] ?? 0) + 1e-9);
  });
}

// Much of what lays out and draws other fonts' letters is taken out of the program (web/small.sh): those of the page do not miss it.
inBrowser('names in every script', { expected: ['willReadFrequently'] }, async b => {
  const page = await b.open(address('theme=dark'));
  await page.see('Drop a folder');
  const names = ['हिन्दी अॆ', '한국어', '한국어'.normalize('NFD'), 'العربية لا', 'ไทย ำ', 'မြန်မာ', 'ខ្មែរ', '日本語', 'עִבְרִית', '👩‍👩‍👧', 'é̂ n̈ ﬁ', 'தமிழ்', 'ᠮᠣᠩ', 'བོད་'];
  for (const name of names) {
    await page.drop([[`${name}.txt`, 'no camera']]);
    await page.see(`${name}.txt`);
  }
});

// WebP and BMP are decoded by the browser, on the desktop by a library: WebP without loss and with some.
inBrowser('WebP and BMP pictures: the same as the desktop program', {}, async b => {
  const [drawn, folder] = ['drawn', 'encoded'].map(name => path.join(scratch, name));
  execFileSync(native, ['synth', '--out', drawn]);
  fs.mkdirSync(folder);
  const page = await b.open(address('theme=dark'));
  for (const [i, name] of fs.readdirSync(drawn).filter(f => f.endsWith('.png')).sort().slice(0, 6).entries()) {
    const bytes = fs.readFileSync(path.join(drawn, name)).toString('base64');
    const kind = ['a little lossy', 'lossless', 'bmp'][i % 3];
    const encoded = await page.page.evaluate(async ([bytes, kind]) => {
      const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(bytes), c => c.charCodeAt(0))]));
      const { width, height } = bitmap;
      const canvas = new OffscreenCanvas(width, height);
      const context = canvas.getContext('2d');
      context.drawImage(bitmap, 0, 0);
      if (kind !== 'bmp') {
        const blob = await canvas.convertToBlob({ type: 'image/webp', quality: kind === 'lossless' ? 1 : 0.9 });
        return [...new Uint8Array(await blob.arrayBuffer())];
      }
      // 24 bits, from the bottom up, blue first, rows of a multiple of four bytes.
      const row = Math.ceil(3 * width / 4) * 4;
      const file = new DataView(new ArrayBuffer(54 + row * height));
      [[0, 0x4D42], [26, 1], [28, 24]].forEach(([at, value]) => file.setUint16(at, value, true));
      [[2, file.byteLength], [10, 54], [14, 40], [18, width], [22, height]].forEach(([at, value]) => file.setUint32(at, value, true));
      const { data } = context.getImageData(0, 0, width, height);
      for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) for (let c = 0; c < 3; c++)
        file.setUint8(54 + row * (height - 1 - y) + 3 * x + c, data[4 * (y * width + x) + 2 - c]);
      return [...new Uint8Array(file.buffer)];
    }, [bytes, kind]);
    fs.writeFileSync(path.join(folder, name.replace('.png', kind === 'bmp' ? '.bmp' : '.webp')), Buffer.from(encoded));
  }
  await page.give('Open folder…', folder);
  await solved(page);
  await idle(page);
  const report = JSON.parse((await exported(page)).bytes);
  const same = run('calibrate', folder, '--json');
  assert.deepEqual(report.frames.map(f => f.corners.length), same.frames.map(f => f.corners.length));
  assert.equal(report.frames.filter(f => f.included).length, 6);
  sameCamera(report, same, (_, at) => 0.1 * (same.sigma[at] ?? 0) + 1e-9);
});

// The parameters of two cameras.
function sameCamera(one, other, allowed) {
  for (const part of ['camera_matrix', 'distortion']) {
    assert.ok(Object.keys(other[part]).length > 0, part);
    near(one[part], other[part], allowed, part);
  }
}

// Every number below `one` beside the same of `other`.
function near(one, other, allowed, at = '') {
  if (typeof other === 'number') {
    assert.ok(Math.abs(one - other) <= allowed(other, at), `${at}: ${one} beside ${other}`);
  } else if (other && typeof other === 'object') {
    for (const key of Object.keys(other)) near(one?.[key], other[key], allowed, key);
  } else {
    assert.notEqual(other, undefined, at);
    assert.deepEqual(one, other, at);
  }
}

inBrowser('a session is there again after a reload, and finds its photographs by their bytes', tall, async b => {
  const page = await b.open(address('theme=light'));
  await page.give('Open folder…', left);
  await solved(page);
  await page.see(node => words(node) === '13 of 13 used', 60000);
  await idle(page);
  const before = words(await solved(page));
  await page.click(node => node.role === 'CheckBox' && words(node) === 'Set aside left02');
  await page.see('of 13 used');
  await page.see(node => words(node) === '12 of 13 used', 60000);
  await page.click('Menu');
  await page.click('View');
  await page.click('Dark theme');
  // It is kept a second after the last change.
  await page.page.waitForTimeout(2500);
  // The look is kept too: this browser itself asks for a light one.
  await page.page.goto(address(''));
  await page.see(node => words(node) === '12 of 13 used', 60000);
  await page.click('Menu');
  await page.click('View');
  await page.see('Light theme');
  await page.page.keyboard.press('Escape');
  await page.see('13 pictures of the session cannot be found');
  await page.click(node => words(node) === 'Use left02');
  await page.see(node => words(node) === '13 of 13 used', 60000);
  await page.see(node => words(node) === before);
  // The same photographs under other names in another folder.
  const moved = path.join(scratch, 'moved');
  fs.mkdirSync(moved);
  jpegs().forEach((f, i) => fs.copyFileSync(path.join(left, f), path.join(moved, `photo ${99 - i}.jpg`)));
  await page.give('Where are they?', moved);
  await page.see('photo 99');
  await page.gone('cannot be found');
});

inBrowser('without a network, and the next version', {}, async b => {
  let page = await b.open(address('demo=seed'));
  await solved(page);
  await page.page.evaluate(async () => (await navigator.serviceWorker.ready).active.state);
  await page.page.reload();
  await solved(page);
  site.down = true;
  try {
    await b.context.setOffline(true);
    await page.page.reload();
    await solved(page);
    await idle(page);
    await page.close();
    page = await b.open(address('demo=seed'));
    await solved(page);
  } finally {
    site.down = false;
    await b.context.setOffline(false);
  }
  // A new version is loaded beside the old one and takes over with the next visit, workers and all.
  const next = path.join(scratch, 'next');
  fs.cpSync(dist, next, { recursive: true });
  const index = path.join(next, 'index.html'), worker = path.join(next, 'sw.js');
  fs.writeFileSync(index, fs.readFileSync(index, 'utf8').replace('<html', '<html data-next'));
  fs.writeFileSync(worker, fs.readFileSync(worker, 'utf8').replace(/VERSION = '/, "VERSION = 'next"));
  site.root = next;
  try {
    const isNext = () => page.page.evaluate(() => document.documentElement.hasAttribute('data-next'));
    await page.page.evaluate(async () => {
      const registration = await navigator.serviceWorker.ready;
      await registration.update();
      while (registration.installing) await new Promise(done => setTimeout(done, 50));
    });
    await page.page.reload();
    await solved(page);
    assert.equal(await isNext(), false, 'an open page is not swapped');
    await page.close();
    await (await b.context.newPage()).waitForTimeout(500);
    page = await b.open(address('demo=seed'));
    await solved(page);
    assert.equal(await isNext(), true);
  } finally { site.root = dist; }
});

// Two fingers that move apart by `by`, about a point.
async function pinch(b, page, x, y, by) {
  const client = await b.context.newCDPSession(page.page);
  const touch = (type, apart) => client.send('Input.dispatchTouchEvent', {
    type, touchPoints: apart === undefined ? [] : [-1, 1].map((side, id) => ({ x: x + side * apart, y: y + side * apart, id })),
  });
  await touch('touchStart', 20);
  for (let step = 1; step <= 10; step++) {
    await touch('touchMove', 20 * by ** (step / 10));
    await page.page.waitForTimeout(30);
  }
  await touch('touchEnd');
}

inBrowser('a phone: dense pixels, a finger, two fingers', { width: 390, height: 844, scale: 3, touch: true }, async b => {
  const page = await b.open(address('theme=dark'));
  const tap = async wanted => { const { x, y, w, h } = await page.see(wanted); await page.page.touchscreen.tap(x + w / 2, y + h / 2); };
  await tap(node => words(node) === 'Try the demo');
  await solved(page);
  await idle(page);
  const { width, height } = await page.page.evaluate(() => { const { width, height } = document.querySelector('canvas'); return { width, height }; });
  assert.deepEqual([width, height], [3 * 390, 3 * 844]);
  const picture = await page.see(node => node.role === 'Image' && words(node).startsWith('Picture '));
  assert.ok(picture.x >= 0 && picture.x + picture.w <= 390, 'the picture is on the screen');
  await looks(b, page, 'phone');
  // How far it zooms depends on when the moves arrive.
  const whole = await page.picture();
  await pinch(b, page, picture.x + picture.w / 2, picture.y + picture.h / 2, 4);
  assert.ok(await differing(b.context, whole, await page.picture()) > 0.03, 'two fingers zoom');
  await tap(node => words(node).startsWith('Errors'));
  await page.see(node => words(node) === 'Distribution');
});

inBrowser('a folder of 5,000 files', tall, async b => {
  const page = await b.open(address('theme=dark'));
  const folder = path.join(scratch, 'crowd');
  fs.mkdirSync(folder);
  for (let i = 0; i < 4990; i++) fs.writeFileSync(path.join(folder, `${i}.log`), 'no picture');
  for (const f of jpegs().slice(0, 10)) fs.copyFileSync(path.join(left, f), path.join(folder, f));
  await page.give('Open folder…', folder);
  await page.see(node => words(node) === '10 of 10 used', 120000);
});

inBrowser('a tab that is closed while it works', tall, async b => {
  let page = await b.open(address('theme=dark'));
  await page.give('Open folder…', left);
  await page.see('left14');
  await page.page.waitForTimeout(1500);
  await page.close();
  page = await b.open(address('theme=dark'));
  await page.see('left14');
  await page.give('Where are they?', left);
  await solved(page);
  await page.see(node => words(node) === '13 of 13 used', 60000);
});

// Files in a ZIP by its directory: [{ name, bytes }] of stored ones.
function archived(zip) {
  const end = zip.lastIndexOf(Buffer.from('504b0506', 'hex'));
  let at = zip.readUInt32LE(end + 16);
  return Array.from({ length: zip.readUInt16LE(end + 10) }, () => {
    const [size, name, extra, comment, header] = [zip.readUInt32LE(at + 20), ...[28, 30, 32].map(o => zip.readUInt16LE(at + o)), zip.readUInt32LE(at + 42)];
    const from = header + 30 + zip.readUInt16LE(header + 26) + zip.readUInt16LE(header + 28);
    const entry = { name: zip.toString('utf8', at + 46, at + 46 + name), bytes: zip.subarray(from, from + size) };
    at += 46 + name + extra + comment;
    return entry;
  });
}

inBrowser('straightened pictures and figures are downloaded as archives', photographs, async b => {
  const page = await b.open(address('theme=dark'));
  await page.give('Open folder…', left);
  await solved(page);
  await idle(page);
  await page.click('Export…');
  await page.click(node => node.role === 'RadioButton' && words(node) === 'Pictures');
  const straightened = archived((await page.download('Straighten all…')).bytes);
  assert.equal(straightened.length, 13);
  for (const { name, bytes } of straightened) assert.ok(bytes.readUInt16BE(0) === 0xffd8 && bytes.length > 10000, name);
  await page.click(node => node.role === 'RadioButton' && words(node) === 'PNG');
  const figures = archived((await page.download('Save all figures…')).bytes);
  assert.ok(figures.length >= 5 && figures.every(f => f.bytes.toString('latin1', 1, 4) === 'PNG'), figures.map(f => f.name).join());
});

inBrowser('a worker that crashes costs one picture', tall, async b => {
  const page = await b.open(address('theme=dark'));
  await page.see('Open folder…');
  // The next request that names this picture reaches its worker as something that it cannot read.
  await page.page.evaluate(() => {
    const post = Worker.prototype.postMessage;
    Worker.prototype.postMessage = function (message, ...rest) {
      if (message?.path?.endsWith('left05.jpg')) message = {};
      return post.call(this, message, ...rest);
    };
  });
  await page.give('Open folder…', left);
  await page.see(node => words(node) === '12 of 13 used', 120000);
  await idle(page);
  assert.match(words(await page.see(node => node.role === 'ListItem' && words(node).startsWith('left05 '))), /internal error, please report it/);
});

inBrowser('cancel: what has been found stays', photographs, async b => {
  const page = await b.open(address('theme=dark'));
  await page.give('Open folder…', copies('many', 6));
  await solved(page);
  await page.click('Cancel');
  await page.see('Go on');
  await page.page.waitForTimeout(500);
  const reading = (await page.nodes()).filter(n => n.role === 'ListItem' && words(n).includes('not read yet')).length;
  await page.page.waitForTimeout(500);
  assert.equal((await page.nodes()).filter(n => n.role === 'ListItem' && words(n).includes('not read yet')).length, reading);
  await page.click('Go on');
  await idle(page);
});

inBrowser('what is no picture says so in a sentence, and costs nothing else', tall, async b => {
  const page = await b.open(address('theme=dark'));
  await page.give('Open folder…', left);
  await solved(page);
  await idle(page);
  const box = brand => Buffer.concat([Buffer.from([0, 0, 0, 24]), Buffer.from(`ftyp${brand}`), Buffer.alloc(12)]);
  await page.drop([
    ['clip.mp4', box('isom')], ['phone.heic', box('heic')], ['notes.txt', 'no picture'], ['blank.png', ''],
    // A raw file of a camera: a TIFF with DNGVersion.
    ['shot.dng', Buffer.from('49492a00080000000100' + '12c60100040000000104000000000000', 'hex')],
    ['cut.jpg', fs.readFileSync(path.join(left, 'left01.jpg')).subarray(0, 3000)],
  ]);
  const says = async (name, why) => assert.match(words(await page.see(node => node.role === 'ListItem' && words(node).startsWith(name) && !words(node).includes('not read yet'))), why);
  await says('clip ', /is a video/);
  await says('phone ', /HEIC.*export/);
  await says('notes ', /not a picture|no picture|text/i);
  await says('shot ', /DNG|raw/i);
  await says('blank ', /empty/);
  await says('cut ', /cut short|damaged/);
  await page.see('of 19 used');
});

inBrowser('a file of 500 MB', {}, async b => {
  const page = await b.open(address('theme=dark'));
  await page.see('Open folder…');
  await page.page.evaluate(() => {
    const part = new Uint8Array(50e6);
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.of(137, 80, 78, 71, 13, 10, 26, 10), ...Array(10).fill(part)], 'huge.png'));
    document.querySelector('canvas').dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
  });
  assert.match(words(await page.see(node => node.role === 'ListItem' && words(node).includes('more than a browser tab opens'))), /500 MB/);
});

const BROKEN = 'Object.defineProperty(window, "indexedDB", { get() { throw new DOMException("no", "SecurityError"); } })';
inBrowser('a private window without a database', { script: BROKEN }, async b => {
  const page = await b.open(address(''));
  await page.see('keeps nothing between visits');
  await page.click('Try the demo');
  await solved(page);
});

const FULL = 'IDBObjectStore.prototype.put = function () { throw new DOMException("full", "QuotaExceededError"); }';
inBrowser('a database that is full', { script: FULL }, async b => {
  const page = await b.open(address(''));
  await page.click('Try the demo');
  await page.see('gives no more room');
  const file = await page.download('Save the session');
  assert.equal(JSON.parse(file.bytes).document.frames.length, 15);
});

inBrowser('a second tab keeps out of the way of the first', {}, async b => {
  await (await b.open(address(''))).see('Open folder…');
  await (await b.open(address(''))).see('open in another tab');
});

inBrowser('the graphics card is taken away', {}, async b => {
  const page = await b.open(address('demo=seed'));
  await solved(page);
  await page.page.evaluate(() => document.querySelector('canvas').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext());
  await page.page.waitForSelector('#loading:not([hidden])');
  assert.match(await page.page.textContent('#words'), /graphics card.*load the page again/);
});

for (const [name, script, why] of [
  ['WebGL', 'HTMLCanvasElement.prototype.getContext = () => null', /needs? ?.*WebGL|draws with WebGL/],
  ['WebAssembly', 'delete window.WebAssembly', /needs WebAssembly/],
]) {
  inBrowser(`a browser without ${name}`, { script }, async b => {
    const page = await b.open(address(''));
    await page.page.waitForSelector('body[data-state=broken]');
    assert.match(await page.page.textContent('#words'), why);
  });
}
