import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vite';

export default defineConfig({
  // Everything is a file of its own: the gateway's Content-Security-Policy allows nothing inline.
  build: {
    target: 'chrome110',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rollupOptions: {
      input: {
        index: fileURLToPath(new URL('index.html', import.meta.url)),
        calibrate: fileURLToPath(new URL('calibrate.html', import.meta.url)),
        wear: fileURLToPath(new URL('wear.html', import.meta.url)),
        wearer: fileURLToPath(new URL('wearer.html', import.meta.url)),
      },
    },
    chunkSizeWarningLimit: 900,
  },
  worker: { format: 'es' },
});
