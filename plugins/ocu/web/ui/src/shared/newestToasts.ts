// Which messages are kept where there is no room for all.
export type Tone = "good" | "plain" | "bad";

/** The newest ones, in their order; what is bad is kept before what is not. */
export function newest<T extends { tone: Tone }>(all: readonly T[], most: number): T[] {
  const bad = all.filter(({ tone }) => tone === "bad");
  const other = all.filter(({ tone }) => tone !== "bad");
  const room = Math.max(0, most - bad.length);
  const kept = new Set([...bad.slice(-most), ...(room > 0 ? other.slice(-room) : [])]);
  return all.filter((each) => kept.has(each));
}
