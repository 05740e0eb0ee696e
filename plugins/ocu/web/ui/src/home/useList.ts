// A list of the server, asked for again now and then while the page is looked at.
import { useEffect, useState } from "preact/hooks";
import { get } from "../shared/api";

const EVERY_MS = 5000;

export interface Listed<Line> {
  /** null: not known yet. */
  lines: readonly Line[] | null;
  failed: boolean;
  refresh(): Promise<void>;
}

export function useList<Line>(path: string): Listed<Line> {
  const [lines, setLines] = useState<readonly Line[] | null>(null);
  const [failed, setFailed] = useState(false);
  const refresh = async () => {
    try {
      setLines(await get<Line[]>(path));
      setFailed(false);
    } catch {
      setFailed(true);
    }
  };
  useEffect(() => {
    void refresh();
    const timer = setInterval(() => {
      if (!document.hidden) void refresh();
    }, EVERY_MS);
    return () => clearInterval(timer);
  }, [path]);
  return { lines, failed, refresh };
}
