// What a person typed as data of a signal or message.

/** null: it is no JSON object. Nothing typed is no data. */
export function dataOf(typed: string): Record<string, unknown> | null {
  if (typed.trim() === "") return {};
  try {
    const value: unknown = JSON.parse(typed);
    const isObject = typeof value === "object" && value !== null && !Array.isArray(value);
    return isObject ? (value as Record<string, unknown>) : null;
  } catch {
    return null;
  }
}
