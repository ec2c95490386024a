// A worker: its first message is the compiled program and where its JavaScript is; from then on the program itself listens.
onmessage = async ({ data: { module, js } }) => {
  onmessage = null;
  try {
    const { default: init } = await import(js);
    await init({ module_or_path: module });
  } catch (error) {
    postMessage({ crashed: String(error?.message ?? error) });
  }
};
