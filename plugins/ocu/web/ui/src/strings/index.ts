// Every text that a person reads, in the language of the page. Others are loaded only when they
// are used; modules that import this one wait for that, so that texts are constants for them.
import { english, type English } from "./english";
import { language } from "./language";
import { translated, type Texts, type Translation } from "./texts";

async function translation(): Promise<Translation<English> | undefined> {
  if (language === "en") return undefined;
  try {
    return (await import("./de")).german;
  } catch {
    return undefined; // The file did not arrive: a page in English is better than none.
  }
}

const found = await translation();

export const strings: Texts<English> = translated(english, found);

if (typeof document !== "undefined") document.documentElement.lang = found ? language : "en";

/** `{name}` in a text becomes its value. */
export function fill(text: string, values: Record<string, string | number>): string {
  return text.replace(/\{(\w+)\}/g, (whole, name: string) => String(values[name] ?? whole));
}

/** A text for one thing, and one for any other number of them. */
export function counted(
  texts: { readonly one: string; readonly many: string },
  count: number,
  values: Record<string, string | number> = {},
): string {
  return fill(count === 1 ? texts.one : texts.many, { count, ...values });
}
