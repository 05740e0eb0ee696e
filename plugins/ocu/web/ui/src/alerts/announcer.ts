// Which alerts are told by sound, message, vibration and speech, and when: once, together, and
// critical ones again until somebody has acknowledged them.
import { isAtLeast, SEVERITIES, type OperatorAlert, type Severity } from "./types";

/** What the user of this browser wants; until they choose, only what is critical sounds. `sound`: the least severe alert that sounds. */
export interface AlertSettings {
  sound: Severity | "off";
  notify: boolean;
  vibrate: boolean;
  speech: boolean;
}

export const DEFAULTS: AlertSettings = {
  sound: "critical",
  notify: false,
  vibrate: true,
  speech: false,
};

/** The ways in which a browser tells something. */
export interface Outputs {
  sound(severity: Severity): void;
  vibrate(severity: Severity): void;
  notify(severity: Severity, text: string): void;
  speak(text: string): void;
}

export class Announcer {
  private known: Set<string> | null = null;
  private calling: readonly OperatorAlert[] = [];

  constructor(
    private readonly outputs: Outputs,
    private readonly settings: () => AlertSettings,
    /** What is told of several alerts. */
    private readonly several: (count: number, first: string) => string,
  ) {}

  /** These are open now. What was there when the page was opened is not told as new. */
  announce(alerts: readonly OperatorAlert[]): void {
    const known = this.known;
    this.known = new Set(alerts.map(({ alert }) => alert));
    this.calling = alerts.filter(({ calls }) => calls);
    if (known === null) return;
    this.tell(this.calling.filter(({ alert }) => !known.has(alert)));
  }

  /** Sound again for critical alerts that still call. */
  again(): void {
    const critical = this.calling.some(({ severity }) => severity === "critical");
    const { sound, vibrate } = this.settings();
    if (!critical) return;
    if (sound !== "off") this.outputs.sound("critical");
    if (vibrate) this.outputs.vibrate("critical");
  }

  /** Tell alerts that are new, all of them at once. */
  tell(fresh: readonly Pick<OperatorAlert, "severity" | "text" | "run">[]): void {
    const { sound, notify, vibrate, speech } = this.settings();
    const worst = SEVERITIES.find((each) => fresh.some(({ severity }) => severity === each));
    const first = fresh.find(({ severity }) => severity === worst);
    if (!worst || !first || worst === "notice") return;
    const told = first.run ? `${first.run}: ${first.text}` : first.text;
    const text = fresh.length > 1 ? this.several(fresh.length, told) : told;
    if (sound !== "off" && isAtLeast(worst, sound)) this.outputs.sound(worst);
    if (vibrate) this.outputs.vibrate(worst);
    if (notify) this.outputs.notify(worst, text);
    if (speech) this.outputs.speak(text);
  }
}
