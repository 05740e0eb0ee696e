// The language of the page: what the user chose in the settings, else the first of the browser's
// languages that the page has, else English. The page takes another one when it is loaded.
import { remembered } from "../shared/memory";

/** By their own names, as those who read them look for them. */
export const LANGUAGES = { en: "English", de: "Deutsch" } as const;

export type Language = keyof typeof LANGUAGES;

const isLanguage = (tag: string | null | undefined): tag is Language =>
  tag != null && Object.hasOwn(LANGUAGES, tag);

/** `preferred`: BCP 47 tags such as "de-AT", best first. */
export function languageOf(chosen: string | null, preferred: readonly string[]): Language {
  if (isLanguage(chosen)) return chosen;
  return preferred.map((tag) => tag.toLowerCase().split("-")[0]).find(isLanguage) ?? "en";
}

/** What the user chose; null: as the browser has it. */
export function chosenLanguage(): Language | null {
  const chosen = remembered<string | null>("language", null);
  return isLanguage(chosen) ? chosen : null;
}

// Tests of the page's modules have no document, and read English everywhere.
export const language: Language =
  typeof document === "undefined" ? "en" : languageOf(chosenLanguage(), navigator.languages);

/** For `Intl`: the browser's own region where it has the language of the page ("en-GB"). */
export const locale: string =
  typeof document === "undefined"
    ? "en"
    : (navigator.languages.find((tag) => tag.toLowerCase().split("-")[0] === language) ?? language);
