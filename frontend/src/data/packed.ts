// Numbers out of base64.

export function bytes(text: string): ArrayBuffer {
  const raw = atob(text);
  const out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
}

/** Little-endian doubles. */
export function doubles(text: string): Float64Array {
  const view = new DataView(bytes(text));
  return Float64Array.from({ length: view.byteLength >> 3 }, (_, i) => view.getFloat64(8 * i, true));
}

/** Little-endian single-precision numbers, as doubles. */
export function singles(text: string): Float64Array {
  const view = new DataView(bytes(text));
  return Float64Array.from({ length: view.byteLength >> 2 }, (_, i) => view.getFloat32(4 * i, true));
}
