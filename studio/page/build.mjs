// Makes the page: node build.mjs [--out DIR]. Three files, which need no other.
import { copyFileSync, mkdirSync, statSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { kVersion } from './version.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const at = process.argv.indexOf('--out');
const out = resolve(at < 0 ? join(here, 'dist') : process.argv[at + 1]);

/** COLLADA is not shown, so its loader is left out of the bundle. */
const withoutCollada = {
  name: 'without COLLADA',
  setup(setup) {
    const name = /^three\/examples\/jsm\/loaders\/ColladaLoader\.js$/;
    setup.onResolve({ filter: name }, (args) => ({ path: args.path, namespace: 'none' }));
    setup.onLoad({ filter: /.*/, namespace: 'none' }, () => ({
      contents: 'export class ColladaLoader {}',
    }));
  },
};

mkdirSync(out, { recursive: true });
await build({
  entryPoints: { studio: join(here, 'src/main.ts') },
  outdir: out,
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2022',
  legalComments: 'inline',
  logLevel: 'warning',
  define: { PAGE_VERSION: JSON.stringify(kVersion) },
  plugins: [withoutCollada],
});
copyFileSync(join(here, 'index.html'), join(out, 'index.html'));
for (const name of ['index.html', 'studio.js', 'studio.css']) {
  process.stdout.write(`${join(out, name)}: ${statSync(join(out, name)).size} bytes\n`);
}
