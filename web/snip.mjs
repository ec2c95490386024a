// Empties functions that the page never calls, though the compiler cannot know it: they trap.
//   node web/snip.mjs FILE.wasm PATTERN... [--return PATTERN...]
// A pattern is part of a function's name as the name section has it. Functions after --return may be called, have no result, and do
// nothing. Nothing else of the file changes; what only those functions
// called is left to wasm-opt.
import fs from 'node:fs';

const [file, ...given] = process.argv.slice(2);
// No locals; `unreachable` or nothing; `end`.
const [TRAP, RETURN] = [[3, 0, 0, 11], [2, 0, 11]].map(body => Buffer.from(body));
const patterns = new Map();
let instead = TRAP;
for (const word of given) word === '--return' ? (instead = RETURN) : patterns.set(word, instead);
const bytes = fs.readFileSync(file);
let at = 8;

// An unsigned number in LEB128.
function number() {
  for (let value = 0, shift = 0; ; shift += 7) {
    const byte = bytes[at++];
    value += (byte & 127) * 2 ** shift;
    if (byte < 128) return value;
  }
}

function leb(value) {
  const out = [];
  do out.push((value & 127) | (value > 127 ? 128 : 0)); while ((value >>>= 7));
  return Buffer.from(out);
}

function text() {
  const length = number();
  return bytes.toString('utf8', at, at += length);
}

const sections = [];
while (at < bytes.length) {
  const id = bytes[at++];
  const length = number();
  sections.push({ id, start: at, end: at += length });
}

// How many functions are imported: their numbers come first.
let imported = 0;
const limits = () => { if (bytes[at++] & 1) number(); number(); };
const skip = { 0: () => { imported++; number(); }, 1: () => { at++; limits(); }, 2: limits, 3: () => { at += 2; }, 4: () => { at++; number(); } };
const imports = sections.find(s => s.id === 2);
if (imports) {
  at = imports.start;
  for (let n = number(); n > 0; n--) { text(); text(); skip[bytes[at++]](); }
}

const emptied = new Map(), met = new Set();
for (const { start, end } of sections.filter(s => s.id === 0)) {
  at = start;
  if (text() !== 'name') continue;
  while (at < end) {
    const kind = bytes[at++];
    const next = number() + at;
    if (kind === 1) {
      for (let n = number(); n > 0; n--) {
        const index = number();
        const name = text();
        // What holds such a thing, or could, is dropped nevertheless.
        const pattern = !name.includes('drop_in_place') && [...patterns.keys()].find(pattern => name.includes(pattern));
        if (pattern) emptied.set(index - imported, patterns.get(pattern)), met.add(pattern);
      }
    }
    at = next;
  }
}
const unmet = [...patterns.keys()].filter(pattern => !met.has(pattern));
if (unmet.length) throw new Error(`${file}: no function has ${unmet} in its name: look what it is called now, or drop it`);

const code = sections.find(s => s.id === 10);
at = code.start;
const count = number();
const bodies = [leb(count)];
for (let i = 0; i < count; i++) {
  const begin = at;
  const length = number();
  at += length;
  bodies.push(emptied.get(i) ?? bytes.subarray(begin, at));
}
const body = Buffer.concat(bodies);
fs.writeFileSync(file, Buffer.concat([bytes.subarray(0, 8), ...sections.flatMap(s => s === code
  ? [Buffer.from([10]), leb(body.length), body]
  : [Buffer.from([s.id]), leb(s.end - s.start), bytes.subarray(s.start, s.end)])]));
console.log(`${emptied.size} functions emptied`);
