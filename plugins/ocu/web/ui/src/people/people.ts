// Who is present, and who asks whom for which vehicle, as every page shows them.
import { effect, signal } from "@preact/signals";
import { get } from "../shared/api";
import { command } from "../shared/command";
import { operatorChanges } from "../shared/executive";
import { session } from "../shared/session";
import { personOf, type Presence } from "./persons";

export interface ControlRequest {
  resource: string;
  by: string;
  holder: string;
  left_s: number;
  given_then: boolean;
  holder_gone: boolean;
  /** Who looks at this page has it, and is asked. */
  mine: boolean;
  /** Who looks at this page has asked. */
  own: boolean;
}

interface Operators {
  operators: Presence[];
  control_requests: ControlRequest[];
}

export const present = signal<readonly Presence[]>([]);
export const requests = signal<readonly ControlRequest[]>([]);

/** When they were read, by this page's clock. */
let readAt_ms = 0;

export const left_s = ({ left_s: then }: ControlRequest): number =>
  Math.max(0, then - (performance.now() - readAt_ms) / 1000);

async function load(): Promise<void> {
  try {
    const found = await get<Operators>("/operators");
    readAt_ms = performance.now();
    present.value = found.operators;
    requests.value = found.control_requests;
  } catch {
    // The next change, or the next connection, reads them again.
  }
}

effect(() => {
  if (session.value && operatorChanges.value > 0) void load();
});

/** Whether the user of this page is the person behind the name of an operator. */
export const isSelf = (operator: string): boolean =>
  operator !== "" && personOf(operator) === personOf(session.value?.user ?? "");

const pathOf = (resource: string) => resource.split("/").map(encodeURIComponent).join("/");

export const askFor = (resource: string): Promise<boolean> =>
  command(`/resources/${pathOf(resource)}/request`);

export const answer = (resource: string, give: boolean): Promise<boolean> =>
  command(`/resources/${pathOf(resource)}/hand-over`, { give });
