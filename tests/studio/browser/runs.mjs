// Runs of bundled experiments, with their studios, for the tests in a browser.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { kPage, lacking } from './support.mjs';

export const kTandem = process.env.TANDEM ?? join(kPage, '../../build/release/bin/tandem');
export const kConfig = join(kPage, '../../config');
const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
let begun = 0;

/** Why the tests of runs cannot run here; empty: they can. */
export function lackingRun() {
  return lacking() || (existsSync(kTandem) ? '' : `${kTandem} is not built`);
}

/** Begins a run of a bundled experiment, with its studio at a free port. */
export async function beginRun(folder, experiment, options) {
  const socket = join(folder, `run-${++begun}.sock`);
  const words = ['run', join(kConfig, experiment), '--socket', socket, '--duration', '300'];
  if (!options.includes('--on-fault')) words.push('--on-fault', 'wait');
  words.push('--studio', ...options);
  if (process.env.TANDEM_STUDIO_PAGE) words.push('--studio-page', process.env.TANDEM_STUDIO_PAGE);
  const child = spawn(kTandem, words, { cwd: folder });
  let said = '';
  for (const stream of [child.stdout, child.stderr]) {
    stream.on('data', (data) => {
      said += data;
    });
  }
  const ended = new Promise((resolve) => child.on('exit', resolve));
  const end = async () => {
    child.kill('SIGINT');
    await ended;
  };
  for (let i = 0; i < 300 && !/studio: http\S+/.test(said); ++i) await sleep(100);
  const address = /studio: (http\S+)/.exec(said)?.[1];
  if (!address) await end();
  assert.ok(address, said);
  const ask = (request) =>
    JSON.parse(
      execFileSync(kTandem, ['ask', JSON.stringify(request), '--socket', socket], {
        encoding: 'utf8',
      }),
    );
  return { address, ask, end, said: () => said };
}
