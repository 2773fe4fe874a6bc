// The recording that `tandem studio LOG` serves: its document, and finer windows than it has.
import { decodeWindow, type Window } from './protocol';

function headers(token: string): Record<string, string> {
  return token ? { Authorization: `Bearer ${token}` } : {};
}

/** The document with the recording; texts in it are no page of ours. @throws Error in words */
export async function servedDocument(path: string, token: string): Promise<Document> {
  const answer = await fetch(path, { headers: headers(token) });
  if (!answer.ok) throw new Error(`${answer.status} ${await answer.text()}`);
  return new DOMParser().parseFromString(await answer.text(), 'text/html');
}

/** A window at the log's own grain. @throws Error in words */
export async function servedWindow(
  token: string,
  signals: number[],
  from: number,
  to: number,
  points: number,
): Promise<Window> {
  const query = `signals=${signals.join()}&from=${from}&to=${to}&points=${Math.round(points)}`;
  const answer = await fetch(`/window?${query}`, { headers: headers(token) });
  if (!answer.ok) throw new Error(`${answer.status} ${await answer.text()}`);
  return decodeWindow(await answer.arrayBuffer());
}
