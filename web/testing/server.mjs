// A server of files in the process of a test, with a line of a given speed before it.

import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { setTimeout as wait } from 'node:timers/promises';

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.wasm': 'application/wasm', '.json': 'application/json' };
/** Bytes that the line takes at once. */
const PIECE = 16384;

/**
 * Serves folders: `places` has the folder of each first part of an address. `line`: bits a second and milliseconds to the first byte; `spoil`: called
 * with an address and its bytes before they are sent, gives what is sent instead: bytes, or the number of an answer.
 */
export async function serve(places) {
  const state = { line: undefined, spoil: undefined, asked: [], free: 0 };
  const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    // Browsers ask for it by themselves.
    if (pathname === '/favicon.ico') return response.writeHead(204).end();
    state.asked.push(pathname);
    const [, place, ...rest] = pathname.split('/');
    const path = normalize(decodeURIComponent(rest.join('/')));
    const folder = places[place];
    if (state.line) await wait(state.line.milliseconds);
    let bytes = folder === undefined || path.startsWith('..') ? 404 : await readFile(join(folder, path)).catch(() => 404);
    if (state.spoil && typeof bytes !== 'number') bytes = state.spoil(pathname, bytes) ?? bytes;
    if (typeof bytes === 'number') return response.writeHead(bytes, state.headers).end();
    response.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream', 'content-length': bytes.length, 'cache-control': 'no-store', ...state.headers });
    await send(response, request.method === 'HEAD' ? new Uint8Array(0) : bytes, state);
    response.end();
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  state.address = `http://127.0.0.1:${server.address().port}`;
  state.close = () => {
    server.closeAllConnections();
    return new Promise((resolve) => server.close(resolve));
  };
  return state;
}

/** All answers share the line. */
async function send(response, bytes, state) {
  if (!state.line) return response.write(bytes);
  for (let at = 0; at < bytes.length; at += PIECE) {
    const piece = bytes.subarray(at, at + PIECE);
    const now = performance.now();
    state.free = Math.max(state.free, now) + (8000 * piece.length) / state.line.bits;
    if (state.free - now > 1) await wait(state.free - now);
    response.write(piece);
  }
}
