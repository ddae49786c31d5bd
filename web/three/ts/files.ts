import { hash } from '@enfilade/runtime';
import { gunzip } from './gunzip.js';
import { MANIFEST, type Entry } from './manifest.js';

/** How often a file is asked for, and the pause after the first failure, milliseconds; it doubles. */
const TRIES = 3;
const PAUSE = 200;
/** A try ends when nothing has come for so long, milliseconds. */
const SILENCE = 15_000;

/** Reads files of a folder, and checks them. */
export class Files {
  /** Bytes that came. */
  bytes = 0;
  /** The folder. */
  readonly folder: URL;
  private readonly stop = new AbortController();

  /** `address`: of the folder, or of a file in it. */
  constructor(address: string | URL) {
    this.folder = new URL('.', new URL(address, globalThis.location?.href));
  }

  /** The text of the manifest. */
  async manifest(): Promise<string> {
    const response = await this.ask(this.address(MANIFEST), { signal: this.stop.signal });
    const bytes = new Uint8Array(await response.arrayBuffer());
    this.bytes += bytes.length;
    try {
      return new TextDecoder().decode(await gunzip(bytes));
    } catch (error) {
      throw new Error(`${MANIFEST}: ${(error as Error).message}`);
    }
  }

  /** The bytes of a file, which are as the manifest says. Asks three times, then throws an `Error` that names it. */
  async read(entry: Entry, urgency: RequestPriority = 'auto'): Promise<Uint8Array<ArrayBuffer>> {
    const address = this.address(entry.file);
    let last: unknown;
    for (let i = 0; i < TRIES; i++) {
      if (i > 0) await this.pause(PAUSE * 2 ** (i - 1));
      try {
        // What is damaged in the browser's own store must not come again from there.
        return await this.once(address, entry, { cache: i === 0 ? 'default' : 'reload', priority: urgency });
      } catch (error) {
        last = error;
        if (this.stop.signal.aborted) break;
      }
    }
    throw new Error(`${entry.file}: ${last instanceof Error ? last.message : String(last)}`);
  }

  /** Ends all that is under way. */
  end(): void {
    this.stop.abort(new Error('the walk has ended'));
  }

  /** The address of a file; nothing leads out of the folder. */
  private address(file: string): URL {
    const address = new URL(file, this.folder);
    if (address.origin !== this.folder.origin || !address.href.startsWith(this.folder.href)) {
      throw new Error(`${file}: leads out of the folder of the manifest`);
    }
    return address;
  }

  private async ask(address: URL, options: RequestInit): Promise<Response> {
    // A redirection may lead to another origin.
    const response = await fetch(address, { ...options, redirect: 'error' });
    if (!response.ok) throw new Error(`the server answers ${response.status}`);
    return response;
  }

  private async once(address: URL, entry: Entry, options: RequestInit): Promise<Uint8Array<ArrayBuffer>> {
    const silence = new Silence();
    try {
      const response = await this.ask(address, { ...options, signal: AbortSignal.any([this.stop.signal, silence.signal]) });
      const told = response.headers.get('content-length');
      if (told !== null && !response.headers.has('content-encoding') && Number(told) !== entry.bytes) {
        await response.body?.cancel();
        throw new Error(`${told} bytes, and the manifest says ${entry.bytes}`);
      }
      const bytes = await this.body(response, entry.bytes, silence);
      const found = hash(bytes);
      if (found !== entry.hash) throw new Error(`its hash is ${found}, and the manifest says ${entry.hash}`);
      return bytes;
    } finally {
      silence.end();
    }
  }

  /** So many bytes: no more are read, and fewer are refused. */
  private async body(response: Response, length: number, silence: Silence): Promise<Uint8Array<ArrayBuffer>> {
    const bytes = new Uint8Array(length);
    const reader = response.body?.getReader();
    let at = 0;
    for (;;) {
      silence.begin();
      const part = await reader?.read();
      if (!part || part.done) break;
      this.bytes += part.value.length;
      if (at + part.value.length > length) {
        await reader?.cancel();
        throw new Error(`more bytes than the ${length} that the manifest says`);
      }
      bytes.set(part.value, at);
      at += part.value.length;
    }
    if (at < length) throw new Error(`${at} bytes, and the manifest says ${length}`);
    return bytes;
  }

  private pause(milliseconds: number): Promise<void> {
    return new Promise((resolve) => {
      const done = (): void => {
        clearTimeout(timer);
        this.stop.signal.removeEventListener('abort', done);
        resolve();
      };
      const timer = setTimeout(done, milliseconds);
      this.stop.signal.addEventListener('abort', done);
    });
  }
}

/** Ends a request when nothing comes. */
class Silence {
  private readonly controller = new AbortController();
  private timer = 0;

  constructor() {
    this.begin();
  }

  get signal(): AbortSignal {
    return this.controller.signal;
  }

  /** Something came. */
  begin(): void {
    this.end();
    this.timer = self.setTimeout(() => this.controller.abort(new Error(`nothing came for ${SILENCE / 1000} s`)), SILENCE);
  }

  end(): void {
    clearTimeout(this.timer);
  }
}
