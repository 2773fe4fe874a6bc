// A page that an open tab has kept, or that --studio-page brings, may be of another version than
// the run.
import { type Hello, kProtocol, kSubprotocol } from './protocol';

const kRemedy = 'Load the page again; of --studio-page build it again.';

/** What does not fit, in words; empty: all does. */
export function misfit(hello: Pick<Hello, 'protocol' | 'version'>, version: string): string {
  if (hello.protocol !== kProtocol) {
    const words = `The run speaks version ${hello.protocol} of the studio, this page ${kProtocol}`;
    return `${words}: what is shown may be wrong. ${kRemedy}`;
  }
  if (hello.version === version) return '';
  return `The run is of Tandem ${hello.version}, this page of ${version}. ${kRemedy}`;
}

/**
 * Why a WebSocket was refused: a browser does not say.
 * @param answer to a plain GET of its address
 */
export function whyRefused(status: number, answer: string): string {
  if (status === 503) return answer.trim();
  if (status !== 426 || answer.includes(kSubprotocol)) return '';
  return `The run does not speak ${kSubprotocol}: it is of another version than this page. ${kRemedy}`;
}
