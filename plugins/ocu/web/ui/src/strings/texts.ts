// What a translation is: the same keys with other texts.

/** Texts of the same keys, whatever they say. */
export type Texts<T> = T extends string
  ? string
  : { readonly [Key in keyof T]: Texts<T[Key]> };

/** A translation; English takes the place of what it lacks, and a test says what that is. */
export type Translation<T> = T extends string
  ? string
  : { readonly [Key in keyof T]?: Translation<T[Key]> };

/** `texts`, with those of the translation in their places. */
export function translated<T>(texts: T, translation: Translation<T> | undefined): Texts<T> {
  if (translation === undefined) return texts as Texts<T>;
  if (typeof texts !== "object" || texts === null) return translation as unknown as Texts<T>;
  const known = translation as Record<string, Translation<unknown>>;
  const entries = Object.entries(texts).map(([key, text]) => [key, translated(text, known[key])]);
  const whole = Array.isArray(texts)
    ? entries.map(([, text]) => text as unknown)
    : Object.fromEntries(entries);
  return whole as Texts<T>;
}
