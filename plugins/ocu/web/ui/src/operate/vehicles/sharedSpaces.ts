// Shared space of the fleet, read again when it has changed, and while a task waits for it.
import { signal } from "@preact/signals";
import { get } from "../../shared/api";
import { spaceChanges } from "../../shared/executive";
import type { SharedSpace } from "../../shared/types";

const WAITING_MS = 1000;

export const sharedSpaces = signal<readonly SharedSpace[]>([]);

/** Keep `sharedSpaces` up to date until the function that is returned is called. */
export function followSharedSpaces(): () => void {
  let isOver = false;
  const read = async () => {
    try {
      const found = await get<{ shared_space: SharedSpace[] }>("/resources");
      if (!isOver) sharedSpaces.value = found.shared_space;
    } catch {
      // The connection says that it is lost; the next change asks again.
    }
  };
  const leave = spaceChanges.subscribe(() => void read());
  const timer = setInterval(() => {
    const isWaiting = sharedSpaces.value.some(({ waiting }) => waiting.length > 0);
    if (isWaiting && !document.hidden) void read();
  }, WAITING_MS);
  return () => {
    isOver = true;
    leave();
    clearInterval(timer);
    sharedSpaces.value = [];
  };
}
