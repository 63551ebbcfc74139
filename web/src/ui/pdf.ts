// A chunk of its own, fetched with the first PDF: most people never need it.
import * as pdfjs from 'pdfjs-dist/legacy/build/pdf.mjs';
import PdfWorker from 'pdfjs-dist/legacy/build/pdf.worker.mjs?worker';
import { MOST_PX, type PageSource } from './picture_file';

const SHARP_PX = 2000; // longer side of a drawn page: its small print can be read

/** The pages of a PDF; rejects with words for a person. */
export async function openPdf(bytes: ArrayBuffer): Promise<PageSource> {
  pdfjs.GlobalWorkerOptions.workerPort ??= new PdfWorker();
  const task = pdfjs.getDocument({ data: bytes, isEvalSupported: false });
  const file = await task.promise.catch((error: unknown) => {
    const locked = error instanceof Error && error.name === 'PasswordException';
    throw new Error(locked ? 'this PDF asks for a password' : 'this PDF cannot be read');
  });
  return {
    pages: file.numPages,
    draw: async (number) => {
      const page = await file.getPage(number);
      const { width, height } = page.getViewport({ scale: 1 });
      const scale = Math.min(SHARP_PX, MOST_PX) / Math.max(width, height);
      const viewport = page.getViewport({ scale });
      const canvas = document.createElement('canvas');
      canvas.width = Math.max(1, Math.round(viewport.width));
      canvas.height = Math.max(1, Math.round(viewport.height));
      const canvasContext = canvas.getContext('2d', { alpha: false });
      if (!canvasContext) throw new Error('this browser has no 2D canvas');
      await page.render({ canvasContext, viewport }).promise;
      page.cleanup();
      return canvas;
    },
    close: () => void task.destroy(),
  };
}
