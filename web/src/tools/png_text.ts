/** CRC-32 of a PNG chunk's type and data (ISO 3309, as PNG 1.2, 3.4). */
function crc32(bytes: Uint8Array): number {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return ~crc >>> 0;
}

const IEND_BYTES = 12;

/**
 * A PNG with a text of its own under `keyword` (an iTXt chunk, UTF-8, not compressed), before its end.
 * `png` is whole, as a canvas makes it.
 */
export function withText(png: Uint8Array, keyword: string, text: string): Uint8Array<ArrayBuffer> {
  const encoder = new TextEncoder();
  // keyword, its end, not compressed (2 bytes), no language, no translated keyword
  const data = encoder.encode(`iTXt${keyword}\0\0\0\0\0${text}`);
  const out = new Uint8Array(png.length + data.length + 8);
  const end = png.length - IEND_BYTES;
  out.set(png.subarray(0, end));
  const view = new DataView(out.buffer);
  view.setUint32(end, data.length - 4);
  out.set(data, end + 4);
  view.setUint32(end + 4 + data.length, crc32(data));
  out.set(png.subarray(end), end + 8 + data.length);
  return out;
}
