import js from '@eslint/js';
import tseslint from 'typescript-eslint';

/** Folders may import only what is listed: data flows from transport to ui (see README.md). */
const layers = {
  geometry: ['scene', 'tools', 'ui', 'session', 'transport', 'decode'],
  transport: ['scene', 'tools', 'ui', 'session', 'decode'],
  decode: ['scene', 'tools', 'ui', 'session', 'transport'],
  session: ['scene', 'tools', 'ui'],
  uplink: ['scene', 'tools', 'ui', 'session', 'decode'],
  talk: ['scene', 'tools', 'ui', 'transport', 'decode', 'uplink'],
  tools: ['scene', 'ui', 'transport'],
  scene: ['ui', 'transport'],
};

export default tseslint.config(
  { ignores: ['dist', 'src/gen', 'node_modules'] },
  js.configs.recommended,
  {
    files: ['src/**/*.ts', 'test/unit/**/*.ts'],
    extends: [...tseslint.configs.strictTypeChecked],
    languageOptions: {
      parserOptions: { projectService: true, tsconfigRootDir: import.meta.dirname },
    },
    rules: {
      '@typescript-eslint/restrict-template-expressions': [
        'error',
        { allowNumber: true, allowBoolean: true },
      ],
      '@typescript-eslint/no-confusing-void-expression': [
        'error',
        { ignoreArrowShorthand: true, ignoreVoidReturningFunctions: true },
      ],
      '@typescript-eslint/switch-exhaustiveness-check': [
        'error',
        { considerDefaultExhaustiveForUnions: true },
      ],
      'max-lines': ['error', 300],
    },
  },
  {
    files: ['test/unit/**/*.ts'],
    rules: {
      '@typescript-eslint/no-non-null-assertion': 'off', // a test may fail on what is not there
      'max-lines': 'off',
    },
  },
  ...Object.entries(layers).map(([folder, forbidden]) => ({
    files: [`src/${folder}/**/*.ts`],
    rules: {
      'no-restricted-imports': [
        'error',
        {
          patterns: [
            ...forbidden.map((name) => ({
              group: [`../${name}/*`],
              message: `${folder} must not see ${name}`,
            })),
            ...(['geometry', 'session', 'transport', 'uplink', 'decode', 'talk', 'tools'].includes(
              folder,
            )
              ? [{ group: ['three', 'three/*'], message: 'three.js belongs to scene' }]
              : []),
          ],
        },
      ],
    },
  })),
  {
    files: ['scripts/**/*.mjs', 'test/browser/**/*.mjs', 'test/recording/**/*.mjs', '*.js', '*.ts'],
    languageOptions: {
      globals: {
        console: 'readonly',
        process: 'readonly',
        setTimeout: 'readonly',
        clearTimeout: 'readonly',
        performance: 'readonly',
        URL: 'readonly',
        Buffer: 'readonly',
        document: 'readonly',
        window: 'readonly',
        sessionStorage: 'readonly',
        localStorage: 'readonly',
        innerWidth: 'readonly',
        innerHeight: 'readonly',
        getComputedStyle: 'readonly',
        AbortController: 'readonly',
        AudioContext: 'readonly',
        AudioNode: 'readonly',
        AudioWorkletNode: 'readonly',
        Blob: 'readonly',
      },
    },
  },
);
