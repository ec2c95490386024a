// The page around the canvas: what is said while it loads, and when it cannot go on.

const element = id => document.getElementById(id);

// The address of the program's JavaScript.
export function program_js() {
  return new URL(element('boot').dataset.js, document.baseURI).href;
}

// The first picture is drawn.
export function ready() {
  element('loading').hidden = true;
  performance.mark('first frame');
  document.body.dataset.state = 'ready';
}

// It cannot go on: says why in a sentence, and what to do.
export function broken(why) {
  element('loading').hidden = false;
  element('bar').hidden = true;
  element('words').textContent = why;
  element('again').hidden = false;
  document.body.dataset.state = 'broken';
}

// Bytes that have come, of all where that is known.
export function progress(loaded, total) {
  const megabytes = (loaded / 1e6).toFixed(1);
  element('words').textContent = total ? `Loading ${megabytes} of ${(total / 1e6).toFixed(1)} MB` : `Loading ${megabytes} MB`;
  element('done').style.width = total ? `${Math.min(100, 100 * loaded / total)}%` : '100%';
}
