// Who did what when: bars of a time line, made of records.
import type { Command, RunRecord } from "../shared/types";

export type SpanKind = "behavior" | "prompt" | "wait" | "service";

/** How it ended: "" while it goes on, "unknown" where its end was not seen. */
export type SpanEnd = "" | "succeeded" | "failed" | "cancelled" | "unknown";

export interface Span {
  id: string;
  kind: SpanKind;
  row: string;
  label: string;
  process: string;
  element: string;
  from: number;
  to: number | null;
  end: SpanEnd;
  reason: string;
  /** How many bars of the row it replaces, which are too short to be seen each; 1 if missing. */
  count?: number;
}

/** The bars that a time line shows. `rows`: those that it has besides the rows of bars. */
export interface Bars {
  readonly all: readonly Span[];
  readonly rows: readonly string[];
}

export const PROMPTS = "prompts";
export const WAITS = "waits";
export const SERVICES = "services";

const ENDS: Record<string, SpanEnd> = {
  SUCCEEDED: "succeeded",
  CANCELLED: "cancelled",
  FAILED: "failed",
  REJECTED: "failed",
  LOST: "failed",
};

export class Spans implements Bars {
  readonly all: Span[] = [];
  private readonly open = new Map<string, Span[]>();
  private readonly asked = new Map<string, RunRecord>();
  private seq = 0;

  get rows(): string[] {
    return [...new Set(this.all.map((span) => span.row))];
  }

  add(record: RunRecord): void {
    if (record.seq <= this.seq) return;
    this.seq = record.seq;
    switch (record.record) {
      case "BehaviorRequested": {
        const resources = (record.resources as string[] | undefined) ?? [];
        this.begin(record, "behavior", text(record, "behavior"), text(record, "name"), resources);
        break;
      }
      case "AllocationRequested":
        this.asked.set(text(record, "allocation"), record);
        break;
      case "AllocationDelayed":
        this.wait(text(record, "allocation"));
        break;
      case "ResourcesAllocated": {
        const roles = (record.roles as Record<string, string[]> | undefined) ?? {};
        this.endWait(record, "succeeded", Object.values(roles).flat().join(", "));
        break;
      }
      case "AllocationEnded": {
        const code = text(record, "code");
        this.endWait(record, code ? "failed" : "cancelled", code);
        break;
      }
      case "PromptOpened":
        this.begin(record, "prompt", text(record, "prompt"), text(record, "text"), [PROMPTS]);
        break;
      case "ServiceRequested":
        this.begin(record, "service", text(record, "service"), text(record, "name"), [SERVICES]);
        break;
      case "BehaviorEnded":
        this.finish(
          `behavior:${text(record, "behavior")}`,
          record.t,
          ENDS[text(record, "state")] ?? "unknown",
          [text(record, "code"), text(record, "reason")].filter(Boolean).join(": "),
        );
        break;
      case "PromptAnswered": {
        const reason = `${text(record, "decision")} (${text(record, "by")})`;
        this.finish(`prompt:${text(record, "prompt")}`, record.t, "succeeded", reason);
        break;
      }
      case "PromptWithdrawn":
        this.finish(`prompt:${text(record, "prompt")}`, record.t, "cancelled", "");
        break;
      case "ServiceEnded": {
        const code = text(record, "code");
        const end = code ? "failed" : "succeeded";
        this.finish(`service:${text(record, "service")}`, record.t, end, code);
        break;
      }
      case "ServiceWithdrawn":
        this.finish(`service:${text(record, "service")}`, record.t, "cancelled", "");
        break;
    }
  }

  /** What is commanded now; for a run whose older records were not read. */
  settle(commands: Record<string, Command>, t: number): void {
    for (const [behavior, command] of Object.entries(commands)) {
      const key = `behavior:${behavior}`;
      if (this.open.has(key)) continue;
      const { process, element, since, name } = command;
      const at = { process, element, t: since } as RunRecord;
      this.begin(at, "behavior", behavior, name, command.resources);
    }
    for (const key of [...this.open.keys()]) {
      const [kind, id] = [key.slice(0, key.indexOf(":")), key.slice(key.indexOf(":") + 1)];
      if (kind === "behavior" && !(id in commands)) this.finish(key, t, "unknown", "");
    }
  }

  /** A task waits from when it asked for resources. */
  private wait(allocation: string): void {
    const record = this.asked.get(allocation);
    if (!record || this.open.has(`wait:${allocation}`)) return;
    this.begin(record, "wait", allocation, text(record, "name"), [WAITS]);
  }

  private endWait(record: RunRecord, end: SpanEnd, reason: string): void {
    const allocation = text(record, "allocation");
    this.asked.delete(allocation);
    this.finish(`wait:${allocation}`, record.t, end, reason);
  }

  private begin(
    record: RunRecord,
    kind: SpanKind,
    id: string,
    label: string,
    rows: readonly string[],
  ): void {
    const spans = rows.map<Span>((row) => ({
      id: `${kind}:${id}:${row}`,
      kind,
      row,
      label,
      process: record.process ?? "",
      element: record.element ?? "",
      from: record.t,
      to: null,
      end: "",
      reason: "",
    }));
    this.all.push(...spans);
    this.open.set(`${kind}:${id}`, spans);
  }

  private finish(key: string, t: number, end: SpanEnd, reason: string): void {
    for (const span of this.open.get(key) ?? []) Object.assign(span, { to: t, end, reason });
    this.open.delete(key);
  }
}

function text(record: RunRecord, field: string): string {
  const value = record[field];
  return typeof value === "string" ? value : "";
}
