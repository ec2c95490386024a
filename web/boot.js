// Checks what the browser can do, loads the program with its progress, and starts it.
import { broken, program_js, progress } from './page.js';

// 128-bit SIMD, which every browser has since 2023.
const SIMD = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11];

function missing() {
  if (typeof WebAssembly !== 'object') return 'Straightedge needs WebAssembly, and this browser has none or it is switched off. Open it in a current Firefox, Chrome, Edge or Safari.';
  if (!WebAssembly.validate(new Uint8Array(SIMD))) return 'This browser is too old for Straightedge (it has no WebAssembly SIMD). Open it in a current Firefox, Chrome, Edge or Safari.';
  // The program gets this same context. It smooths its edges itself and draws flat: several samples a pixel and depth would be for nothing.
  if (!document.getElementById('app').getContext('webgl2', { antialias: false, depth: false })) return 'Straightedge draws with WebGL 2, and this browser has none or it is switched off. Switch on hardware acceleration in its settings, or use another browser.';
}

async function program() {
  const { wasm } = document.getElementById('boot').dataset;
  const response = await fetch(new URL(wasm, document.baseURI));
  if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
  // A compressed answer says how long it is compressed: that is no measure of what is counted here.
  const total = response.headers.has('content-encoding') ? 0 : +response.headers.get('content-length');
  let loaded = 0;
  const counted = new TransformStream({
    transform(part, out) { progress(loaded += part.length, total); out.enqueue(part); },
  });
  return new Response(response.body.pipeThrough(counted), { headers: { 'content-type': 'application/wasm' } });
}

const why = missing();
if (why) {
  broken(why);
} else {
  document.getElementById('app').addEventListener('webglcontextlost', () => broken('The browser took the graphics card away from this page. What you did is kept: load the page again.'));
  try {
    const { default: init } = await import(program_js());
    await init({ module_or_path: program() });
  } catch (error) {
    broken(`Straightedge could not be loaded (${error?.message ?? error}). Check the connection and load the page again.`);
  }
}
document.getElementById('again').addEventListener('click', () => location.reload());
// Without it the page works, but not offline.
navigator.serviceWorker?.register('sw.js', { updateViaCache: 'none' }).catch(() => {});
