// Bundles the tests, test/*.test.ts, and runs them: node test/run.mjs
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const here = dirname(fileURLToPath(import.meta.url));
const names = readdirSync(here).filter((name) => name.endsWith('.test.ts'));
const out = mkdtempSync(join(tmpdir(), 'tandem-page-'));
try {
  await build({
    entryPoints: names.map((name) => join(here, name)),
    outdir: out,
    outExtension: { '.js': '.mjs' },
    bundle: true,
    platform: 'node',
    format: 'esm',
    target: 'node18',
    logLevel: 'warning',
  });
  const files = names.map((name) => join(out, name.replace(/\.ts$/, '.mjs')));
  const env = { ...process.env, TANDEM_CONFIG: join(here, '../../../config') };
  process.exitCode =
    spawnSync(process.execPath, ['--test', ...files], { timeout: 240_000, stdio: 'inherit', env })
      .status ?? 1;
} finally {
  rmSync(out, { recursive: true, force: true });
}
