// The connection on which the server pushes: one for the whole page, made again whenever it breaks.
// Frames are applied when the browser is about to paint, and acknowledged only then: the server
// sends no more of them than this page can show.
import type { ServerMessage } from "./types";

export type Connection = "connecting" | "open" | "lost" | "refused";

/** The part of a WebSocket that is used. */
export interface Socket {
  /** `OPEN`, or it is being made or closed. */
  readonly readyState: number;
  send(text: string): void;
  close(): void;
  onopen: (() => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  onclose: ((event: { code: number }) => void) | null;
}

export interface Surroundings {
  connect(): Socket;
  /** Call back when something may be drawn. */
  paint(callback: () => void): void;
  /** Call back after some milliseconds; what is returned prevents it. */
  after(callback: () => void, delay_ms: number): () => void;
  /** Call back again and again; what is returned ends it. */
  every(callback: () => void, ms: number): () => void;
  /** A clock that only rises. */
  now_ms(): number;
  /** 0 ... 1, so that not all pages come back at once. */
  chance(): number;
}

export interface Listener {
  received(message: ServerMessage): void;
  connection(state: Connection): void;
}

const FIRST_DELAY_MS = 500;
const LONGEST_DELAY_MS = 4000;
/** Frames come every second: a connection that says nothing for so long is dead. */
export const SILENT_MS = 3000;
/** Within which a connection is made. */
const OPENING_MS = 5000;
const LOOK_MS = 250;
const NO_CLOSE = 1006;
/** `WebSocket.OPEN` */
const OPEN = 1;
/** Not signed in (any more): to ask again is of no use. 1008 is a policy violation. */
const REFUSED = new Set([1008, 4001, 4401, 4403]);

export class LiveClient {
  private socket: Socket | null = null;
  private waiting: ServerMessage[] = [];
  private failures = 0;
  private cancelRetry: (() => void) | null = null;
  private watched: string | null = null;
  private edited: string | null = null;
  private isOpen = false;
  /** From a break until it is open again, however often that is tried. */
  private isBroken = false;
  private heardAt_ms = 0;
  private isSuspect = false;
  private stopLooking: (() => void) | null = null;

  constructor(
    private readonly around: Surroundings,
    private readonly listener: Listener,
  ) {}

  start(): void {
    if (this.socket) return;
    this.cancelRetry?.();
    this.cancelRetry = null;
    if (!this.isBroken) this.listener.connection("connecting");
    const socket = this.around.connect();
    this.socket = socket;
    this.heard();
    this.stopLooking = this.around.every(() => this.look(), LOOK_MS);
    socket.onopen = () => {
      this.failures = 0;
      this.isBroken = false;
      this.isOpen = true;
      this.heard();
      this.say({ type: "watch", run: this.watched });
      if (this.edited !== null) this.say({ type: "edit", mission: this.edited });
      this.listener.connection("open");
    };
    socket.onmessage = (event) => this.take(String(event.data));
    socket.onclose = (event) => this.closed(event.code);
  }

  stop(): void {
    this.cancelRetry?.();
    this.cancelRetry = null;
    const socket = this.socket;
    this.forget();
    this.isBroken = false;
    socket?.close();
  }

  /** Watch a run; null: none. A snapshot of it comes. */
  watch(run: string | null): void {
    if (this.watched === run) return;
    this.watched = run;
    if (this.isOpen) this.say({ type: "watch", run });
  }

  /** Announce which mission this page edits; null: none. */
  edit(mission: string | null): void {
    if (this.edited === mission) return;
    this.edited = mission;
    if (this.isOpen) this.say({ type: "edit", mission });
  }

  private heard(): void {
    this.heardAt_ms = this.around.now_ms();
    this.isSuspect = false;
  }

  /** Twice in a row: what has come while this page was busy is taken between the two. */
  private look(): void {
    const silent_ms = this.around.now_ms() - this.heardAt_ms;
    const isSilent = silent_ms >= (this.isOpen ? SILENT_MS : OPENING_MS);
    const socket = this.socket;
    if (isSilent && this.isSuspect) {
      this.closed(NO_CLOSE);
      socket?.close();
    }
    this.isSuspect = isSilent;
  }

  private take(text: string): void {
    const message = JSON.parse(text) as ServerMessage;
    // Frames are sent only if this page has acknowledged those before: both directions work.
    if (message.type === "snapshot" || message.type === "frame" || message.type === "alive")
      this.heard();
    if (message.type !== "snapshot" && message.type !== "frame") {
      // Urgent ones come at once; but never before the frames that were sent before them.
      this.apply();
      this.listener.received(message);
      return;
    }
    this.waiting.push(message);
    if (this.waiting.length === 1) this.around.paint(() => this.apply());
  }

  private apply(): void {
    const messages = this.waiting;
    this.waiting = [];
    for (const message of messages) {
      if ("run" in message && message.run === this.watched) this.listener.received(message);
      this.say({ type: "ack", seq: message.seq });
    }
  }

  private say(message: object): void {
    // The server may be closing it, of which `onclose` tells only when that is done.
    if (this.isOpen && this.socket?.readyState === OPEN) this.socket.send(JSON.stringify(message));
  }

  private forget(): void {
    this.stopLooking?.();
    this.stopLooking = null;
    if (this.socket) {
      this.socket.onopen = this.socket.onmessage = this.socket.onclose = null;
    }
    this.socket = null;
    this.isOpen = false;
    this.waiting = [];
  }

  private closed(code: number): void {
    this.forget();
    this.isBroken = !REFUSED.has(code);
    if (!this.isBroken) {
      this.listener.connection("refused");
      return;
    }
    this.listener.connection("lost");
    const longest = Math.min(LONGEST_DELAY_MS, FIRST_DELAY_MS * 2 ** this.failures);
    this.failures += 1;
    const delay_ms = longest * (0.5 + this.around.chance() / 2);
    this.cancelRetry = this.around.after(() => this.start(), delay_ms);
  }
}
