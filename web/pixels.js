// WebP and BMP by the browser's own decoders: those in the program would be a fortieth more to load.

// The pixels of a WebP or BMP picture as it is stored, RGBA; nothing for other files.
export async function browser_pixels(file) {
  const head = String.fromCharCode(...new Uint8Array(await file.slice(0, 12).arrayBuffer()));
  if (!(head.startsWith('RIFF') && head.endsWith('WEBP')) && !head.startsWith('BM')) return undefined;
  const as_stored = { imageOrientation: 'none', premultiplyAlpha: 'none', colorSpaceConversion: 'none' };
  const bitmap = await createImageBitmap(file, as_stored).catch(() => undefined);
  if (!bitmap) return undefined;
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext('2d');
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return { width, height, rgba: new Uint8Array(context.getImageData(0, 0, width, height).data.buffer) };
}
