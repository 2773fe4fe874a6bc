// The version of Tandem that this page belongs to.
import { readFileSync } from 'node:fs';

const text = readFileSync(new URL('../../CMakeLists.txt', import.meta.url), 'utf8');
export const kVersion = /project\(tandem VERSION ([\d.]+)/.exec(text)?.[1] ?? 'unknown';
