import type * as english from "../settings";
import type { Translation } from "../texts";

export const settings: Translation<typeof english.settings> = {
  title: "Einstellungen",
  hint: "Für diesen Browser. Sie bleiben, bis seine Daten gelöscht werden.",
  done: "Fertig",
  theme: "Farben",
  themes: {
    system: "Wie im System",
    light: "Hell",
    dark: "Dunkel",
    contrast: "Hoher Kontrast",
  },
  textSize: "Textgröße",
  textSizeHint: "Nicht größer, als für STOP in diesem Fenster Platz bleibt.",
  percent: "{percent} %",
  controls: "Schaltflächen und Felder",
  controlsHint: "Große lassen sich mit Handschuhen treffen.",
  controlSizes: { usual: "Üblich", large: "Groß" },
  language: "Sprache",
  languageHint:
    "Was die Missionssteuerung sagt, etwa Befunde und Gründe, bleibt Englisch.",
  browserLanguage: "Wie im Browser",
  reload: "Seite neu laden",
  reloadHint: "Die Seite übernimmt sie, wenn sie neu geladen wird.",
  reloadWaits:
    "Ein STOP ist noch nicht bestätigt: Bis dahin muss die Seite bleiben, wie sie ist.",
};
