import { beforeEach, describe, expect, it } from "vitest";
import { LiveClient, type Connection, type Socket, type Surroundings } from "./live";
import type { ServerMessage } from "./types";

class FakeSocket implements Socket {
  sent: unknown[] = [];
  closed = false;
  readyState = 1;
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;

  send(text: string): void {
    this.sent.push(JSON.parse(text));
  }

  close(): void {
    this.closed = true;
  }

  tell(message: object): void {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
}

let sockets: FakeSocket[];
let paints: (() => void)[];
let timers: { callback: () => void; delay_ms: number; cancelled: boolean }[];
let received: ServerMessage[];
let states: Connection[];
let client: LiveClient;
let now_ms: number;
let looks: Set<() => void>;

const around: Surroundings = {
  connect: () => {
    const socket = new FakeSocket();
    sockets.push(socket);
    return socket;
  },
  paint: (callback) => void paints.push(callback),
  after: (callback, delay_ms) => {
    const timer = { callback, delay_ms, cancelled: false };
    timers.push(timer);
    return () => {
      timer.cancelled = true;
    };
  },
  every: (callback) => {
    looks.add(callback);
    return () => void looks.delete(callback);
  },
  now_ms: () => now_ms,
  chance: () => 1,
};

const frame = (seq: number, run: string | null = "r1") => ({
  type: "frame",
  seq,
  run,
  t: seq,
  events: seq,
});
const newest = () => sockets.at(-1)!;
const pass = (ms: number) => {
  for (const end = now_ms + ms; now_ms < end; ) {
    now_ms += 50;
    if (now_ms % 250 === 0) looks.forEach((look) => look());
  }
};
const draw = () => paints.splice(0).forEach((paint) => paint());

beforeEach(() => {
  sockets = [];
  paints = [];
  timers = [];
  received = [];
  states = [];
  now_ms = 0;
  looks = new Set();
  client = new LiveClient(around, {
    received: (message) => void received.push(message),
    connection: (state) => void states.push(state),
  });
  client.watch("r1");
  client.start();
  newest().onopen!();
});

describe("live client", () => {
  it("says nothing on a connection that the server is closing", () => {
    newest().onopen?.();
    newest().tell(frame(1));
    newest().readyState = 2;
    const before = newest().sent.length;
    draw();
    expect(newest().sent.length).toBe(before);
  });

  it("says what it watches, first of all", () => {
    expect(newest().sent).toEqual([{ type: "watch", run: "r1" }]);
    expect(states).toEqual(["connecting", "open"]);
  });

  it("applies and acknowledges frames when it may paint, not before", () => {
    newest().tell(frame(1));
    newest().tell(frame(2));
    expect(received).toEqual([]);
    expect(paints).toHaveLength(1);
    draw();
    expect(received.map(({ seq }) => seq)).toEqual([1, 2]);
    expect(newest().sent.slice(1)).toEqual([
      { type: "ack", seq: 1 },
      { type: "ack", seq: 2 },
    ]);
  });

  it("tells what is urgent at once, after the frames that came before it", () => {
    newest().tell(frame(1));
    newest().tell({ type: "fault", seq: 2, text: "late" });
    expect(received.map(({ type }) => type)).toEqual(["frame", "fault"]);
    draw();
    expect(received).toHaveLength(2);
    expect(newest().sent).toHaveLength(2);
  });

  it("acknowledges frames of a run that is not watched any more, and drops them", () => {
    newest().tell(frame(1, "r1"));
    client.watch("r2");
    draw();
    expect(received).toEqual([]);
    expect(newest().sent.slice(1)).toEqual([
      { type: "watch", run: "r2" },
      { type: "ack", seq: 1 },
    ]);
  });

  it("comes back with a longer wait each time, and asks for the same run", () => {
    for (const delay_ms of [500, 1000, 2000, 4000, 4000]) {
      newest().onclose!({ code: 1006 });
      expect(timers.at(-1)!.delay_ms).toBe(delay_ms);
      timers.at(-1)!.callback();
    }
    newest().onopen!();
    expect(newest().sent).toEqual([{ type: "watch", run: "r1" }]);
    newest().onclose!({ code: 4008 });
    expect(timers.at(-1)!.delay_ms).toBe(500);
  });

  it("says that it is broken once, until it is open again", () => {
    newest().onclose!({ code: 1006 });
    timers.at(-1)!.callback();
    expect(states.slice(2)).toEqual(["lost"]);
    newest().onopen!();
    expect(states.slice(2)).toEqual(["lost", "open"]);
  });

  it("drops what a broken connection had sent and was not applied", () => {
    newest().tell(frame(7));
    newest().onclose!({ code: 1006 });
    timers.at(-1)!.callback();
    newest().onopen!();
    draw();
    expect(received).toEqual([]);
    expect(newest().sent).toEqual([{ type: "watch", run: "r1" }]);
    newest().tell(frame(1));
    draw();
    expect(received).toHaveLength(1);
  });

  it("does not come back when it was refused", () => {
    newest().onclose!({ code: 4401 });
    expect(states.at(-1)).toBe("refused");
    expect(timers).toEqual([]);
  });

  it("can be told to try now, once", () => {
    newest().onclose!({ code: 1006 });
    client.start();
    client.start();
    expect(sockets).toHaveLength(2);
    expect(timers[0]!.cancelled).toBe(true);
  });

  it("is lost when frames stop, though nothing was closed, and tries again", () => {
    const socket = newest();
    pass(2900);
    expect(states.at(-1)).toBe("open");
    newest().tell(frame(1));
    pass(2900);
    expect(states.at(-1)).toBe("open");
    pass(600);
    expect(states.at(-1)).toBe("lost");
    expect(socket.closed).toBe(true);
    expect(socket.onmessage).toBeNull();
    timers.at(-1)!.callback();
    pass(5600); // this one is never made
    expect(timers).toHaveLength(2);
    expect(states.filter((state) => state === "lost")).toHaveLength(2);
  });

  it("does not count what was told without an acknowledgement: commands might not pass", () => {
    for (let seq = 1; seq < 16; seq += 1) {
      newest().tell({ type: "fault", seq, text: "still sent" });
      pass(250);
    }
    expect(states.at(-1)).toBe("lost");
  });

  it("is not lost because the page itself was busy", () => {
    now_ms += 9000;
    looks.forEach((look) => look());
    newest().tell(frame(1));
    looks.forEach((look) => look());
    expect(states.at(-1)).toBe("open");
  });

  it("stops for good", () => {
    const socket = newest();
    client.stop();
    expect(socket.closed).toBe(true);
    expect(socket.onclose).toBeNull();
    expect(timers).toEqual([]);
  });
});
