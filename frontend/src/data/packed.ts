// Numbers out of base64.

export function bytes(text: string): ArrayBuffer {
  const raw = atob(text);
  const out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
}

/** Little-endian doubles, as are those of every machine that the laws' scripts fly on. */
export function doubles(text: string): Float64Array {
  return new Float64Array(bytes(text));
}

/** Little-endian single-precision numbers, as doubles. */
export function singles(text: string): Float64Array {
  return Float64Array.from(new Float32Array(bytes(text)));
}
