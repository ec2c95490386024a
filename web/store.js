// What the page keeps between visits: records of bytes by name in IndexedDB. The first tab has it; another one keeps nothing.

let open;

function database() {
  return open ??= new Promise((done, failed) => {
    const request = indexedDB.open('straightedge', 1);
    request.onupgradeneeded = () => request.result.createObjectStore('session');
    request.onsuccess = () => done(request.result);
    request.onerror = () => failed(request.error);
  });
}

async function inside(mode, work) {
  const transaction = (await database()).transaction('session', mode);
  const answer = work(transaction.objectStore('session'));
  return new Promise((done, failed) => {
    transaction.oncomplete = () => done(answer.result);
    transaction.onabort = transaction.onerror = () => failed(transaction.error ?? answer.error);
  });
}

// Whether this tab may keep the session: no other one does.
export function take() {
  if (!navigator.locks) return Promise.resolve(true);
  return new Promise(done => {
    navigator.locks.request('straightedge session', { ifAvailable: true }, lock => {
      done(!!lock);
      // Held for as long as the page lives.
      return lock ? new Promise(() => {}) : undefined;
    }).catch(() => done(true));
  });
}

// Every record: [[name, bytes]].
export async function all() {
  let names;
  const values = await inside('readonly', store => {
    names = store.getAllKeys();
    return store.getAll();
  });
  return names.result.map((name, i) => [name, values[i]]);
}

// Writes records and drops others, both or nothing.
export function write(records, dropped) {
  return inside('readwrite', store => {
    for (const name of dropped) store.delete(name);
    let last = {};
    for (const [name, bytes] of records) last = store.put(bytes, name);
    return last;
  });
}
