// How the names of places begin for which the author has still to choose what is done. A mission
// may have been drawn in another language than that of the page.
import type { Language } from "./language";

export const OPEN_PLACES = {
  en: "Choose what is done",
  de: "Wählen Sie, was getan wird",
} as const satisfies Record<Language, string>;
