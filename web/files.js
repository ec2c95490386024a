// Files in and out of the page: what the user picks or drops, and downloads.

// Files below a dropped folder, with their paths.
async function walk(entry, path, found) {
  if (entry.isFile) {
    found.push({ path, file: await new Promise((done, failed) => entry.file(done, failed)) });
    return;
  }
  const reader = entry.createReader();
  for (;;) {
    // A browser answers a hundred at a time.
    const some = await new Promise((done, failed) => reader.readEntries(done, failed));
    if (!some.length) return;
    for (const below of some) if (!below.name.startsWith('.')) await walk(below, `${path}/${below.name}`, found);
  }
}

// Hears drops on the page before anyone else: `dropped` with [{ path, file }], or `failed` with words.
export function watch(dropped, failed) {
  addEventListener('drop', async event => {
    const items = [...event.dataTransfer?.items ?? []].filter(item => item.kind === 'file');
    if (!items.length) return;
    event.preventDefault();
    event.stopPropagation();
    document.querySelector('canvas')?.dispatchEvent(new DragEvent('dragleave'));
    // Entries are only there during the event.
    const given = items.map(item => ({ entry: item.webkitGetAsEntry?.(), file: item.getAsFile() }));
    const found = [];
    try {
      for (const { entry, file } of given) {
        if (entry) await walk(entry, entry.name, found);
        else if (file) found.push({ path: file.name, file });
      }
      dropped(found);
    } catch (error) { failed(String(error?.message ?? error)); }
  }, { capture: true });
  addEventListener('dragover', event => event.preventDefault());
}

// Asks for files; answers [{ path, file }], empty where nothing was chosen.
export function pick(folder, accept) {
  return new Promise(done => {
    const input = document.createElement('input');
    Object.assign(input, { type: 'file', multiple: true, accept, webkitdirectory: folder, hidden: true });
    const end = files => { input.remove(); done(files); };
    input.addEventListener('change', () => end([...input.files].map(file => ({ path: file.webkitRelativePath || file.name, file }))));
    input.addEventListener('cancel', () => end([]));
    document.body.append(input);
    input.click();
  });
}

// Downloads a file that is made of parts.
export function save(name, parts, type) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob(parts, { type }));
  link.download = name;
  link.click();
  // The browser takes the address at once; a minute is for those that ask first.
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
