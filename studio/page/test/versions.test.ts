import assert from 'node:assert/strict';
import { test } from 'node:test';
import { misfit, whyRefused } from '../src/versions';

test('a page says when it is of another version than the run', () => {
  assert.equal(misfit({ protocol: 1, version: '1.2.0' }, '1.2.0'), '');
  assert.match(misfit({ protocol: 1, version: '1.3.0' }, '1.2.0'), /1\.3\.0.*1\.2\.0.*Load the/);
  assert.match(misfit({ protocol: 2, version: '1.2.0' }, '1.2.0'), /version 2 .* this page 1/);
});

test('a page says why its WebSocket was refused', () => {
  assert.equal(whyRefused(426, 'This is a WebSocket of tandem.studio.v1.\n'), '');
  assert.match(whyRefused(426, 'This is a WebSocket of tandem.studio.v2.\n'), /another version/);
  assert.equal(
    whyRefused(503, '32 pages look at this run already.\n'),
    '32 pages look at this run already.',
  );
  assert.equal(whyRefused(200, ''), '');
});
