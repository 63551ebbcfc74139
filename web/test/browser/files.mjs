// Files a person might pin to a place, made here.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import pngjs from 'pngjs';

/** 320 x 200, orange with a dark frame. */
export function samplePng(folder) {
  const image = new pngjs.PNG({ width: 320, height: 200 });
  for (let y = 0; y < 200; ++y) {
    for (let x = 0; x < 320; ++x) {
      const edge = x < 12 || y < 12 || x >= 308 || y >= 188;
      image.data.set(edge ? [30, 30, 30, 255] : [240, 150, 40, 255], 4 * (320 * y + x));
    }
  }
  const path = join(folder, 'wiring.png');
  writeFileSync(path, pngjs.PNG.sync.write(image));
  return path;
}

/** Two pages: the first is blue, the second green, each with a word on it. */
export function samplePdf(folder) {
  const page = (colour, word) =>
    `${colour} rg 0 0 300 400 re f 1 1 1 rg BT /F1 36 Tf 40 330 Td (${word}) Tj ET`;
  const streams = [page('0.1 0.2 0.8', 'First'), page('0 0.75 0.1', 'Second')];
  const objects = [
    '<< /Type /Catalog /Pages 2 0 R >>',
    '<< /Type /Pages /Kids [3 0 R 4 0 R] /Count 2 >>',
    ...[6, 7].map(
      (content) =>
        `<< /Type /Page /Parent 2 0 R /MediaBox [0 0 300 400] /Contents ${content} 0 R ` +
        '/Resources << /Font << /F1 5 0 R >> >> >>',
    ),
    '<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>',
    ...streams.map((text) => `<< /Length ${text.length} >>\nstream\n${text}\nendstream`),
  ];
  let pdf = '%PDF-1.4\n';
  const offsets = objects.map((body, i) => {
    const at = pdf.length;
    pdf += `${i + 1} 0 obj\n${body}\nendobj\n`;
    return at;
  });
  const table = pdf.length;
  const rows = offsets.map((at) => `${String(at).padStart(10, '0')} 00000 n \n`).join('');
  pdf += `xref\n0 ${objects.length + 1}\n0000000000 65535 f \n${rows}`;
  pdf += `trailer\n<< /Size ${objects.length + 1} /Root 1 0 R >>\nstartxref\n${table}\n%%EOF\n`;
  const path = join(folder, 'manual.pdf');
  writeFileSync(path, pdf, 'latin1');
  return path;
}
