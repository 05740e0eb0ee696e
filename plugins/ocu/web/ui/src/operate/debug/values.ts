// What a person types as a value of the data.

/** undefined: it is no JSON. */
export function valueOf(typed: string): unknown {
  try {
    return JSON.parse(typed) as unknown;
  } catch {
    return undefined;
  }
}
