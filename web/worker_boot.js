// A worker: its first message is the compiled program; from then on the program itself listens.
importScripts('worker.js');
onmessage = event => {
  onmessage = null;
  wasm_bindgen({ module_or_path: event.data }).catch(error => postMessage({ crashed: String(error?.message ?? error) }));
};
