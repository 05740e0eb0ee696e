// One camera's stream: how it is, and trying again when it has ended.
import { signal, type ReadonlySignal } from "@preact/signals";
import type { Video } from "../../shared/types";
import { strings } from "../../strings";
import { playHls } from "./hls";
import { playImages } from "./image";
import { playMjpeg } from "./mjpeg";
import type { Player } from "./player";
import { playWhep } from "./whep";

const PLAYERS: Record<Video["kind"], Player> = {
  hls: playHls,
  webrtc: playWhep,
  mjpeg: playMjpeg,
  image: playImages,
};

/** Seconds until it is tried again: longer each time, until pictures come. */
const AGAIN_S = [1, 2, 5, 10, 20];
/** Without a picture for so long from the start, it has failed. */
const FIRST_WITHIN_S = 15;
/** Older pictures are no longer what the camera sees. */
const OLD_S = 4;

export type StreamState =
  | { is: "connecting" }
  /** `age_s`: of the last picture; null: nobody knows. */
  | { is: "playing"; age_s: number | null }
  | { is: "old"; age_s: number }
  | { is: "failed"; reason: string; again_s: number };

export class Stream {
  readonly state: ReadonlySignal<StreamState>;
  private readonly told = signal<StreamState>({ is: "connecting" });
  private readonly ticking: ReturnType<typeof setInterval>;
  private stop: () => void = () => undefined;
  private begun_ms = 0;
  private frame_ms: number | null = null;
  private ageless = false;
  private failures = 0;
  private failed: { reason: string; until_ms: number } | null = null;

  constructor(
    private readonly host: HTMLElement,
    private readonly video: Video,
  ) {
    this.state = this.told;
    this.begin();
    this.ticking = setInterval(() => this.tick(), 500);
  }

  dispose(): void {
    clearInterval(this.ticking);
    this.stop();
    this.host.replaceChildren();
  }

  private begin(): void {
    this.failed = null;
    this.frame_ms = null;
    this.ageless = false;
    this.begun_ms = performance.now();
    const begun_ms = this.begun_ms;
    const current = () => begun_ms === this.begun_ms && !this.failed;
    if (location.protocol === "https:" && this.video.url.startsWith("http:")) {
      this.fail(strings.cameras.mixed);
      return;
    }
    this.stop = PLAYERS[this.video.kind](this.host, this.video, {
      frame: () => {
        if (!current()) return;
        this.frame_ms = performance.now();
        this.failures = 0;
      },
      playing: () => {
        if (!current()) return;
        this.ageless = true;
        this.failures = 0;
      },
      failed: (reason) => current() && this.fail(reason),
    });
    this.tick();
  }

  private fail(reason: string): void {
    this.stop();
    this.stop = () => undefined;
    this.host.replaceChildren();
    const wait_s = AGAIN_S[Math.min(this.failures, AGAIN_S.length - 1)]!;
    this.failures += 1;
    this.failed = { reason, until_ms: performance.now() + wait_s * 1000 };
    this.tick();
  }

  private tick(): void {
    const now_ms = performance.now();
    if (this.failed) {
      const again_s = Math.ceil((this.failed.until_ms - now_ms) / 1000);
      if (again_s <= 0) this.begin();
      else this.told.value = { is: "failed", reason: this.failed.reason, again_s };
      return;
    }
    if (this.frame_ms !== null) {
      const age_s = (now_ms - this.frame_ms) / 1000;
      const old_s = this.video.kind === "image" ? Math.max(OLD_S, 3 * this.video.every_s) : OLD_S;
      this.told.value = { is: age_s > old_s ? "old" : "playing", age_s };
    } else if (this.ageless) {
      this.told.value = { is: "playing", age_s: null };
    } else if (now_ms - this.begun_ms > FIRST_WITHIN_S * 1000) {
      this.fail(strings.cameras.nothingCame);
    } else {
      this.told.value = { is: "connecting" };
    }
  }
}
