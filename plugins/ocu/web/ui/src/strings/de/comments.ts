import type * as english from "../comments";
import type { Translation } from "../texts";

export const comments: Translation<typeof english.comments> = {
  title: "Kommentare",
  ofElement: "Kommentar zu {element}",
  ofMission: "Kommentar zur ganzen Mission",
  hint: "Wählen Sie ein Element, um es zu kommentieren. Alle, die die Mission offen haben, sehen den Kommentar sofort. Kommentare liegen neben der Mission, nicht in ihrer Datei: Sie ändern keine Freigabe.",
  add: "Kommentieren",
  answer: "Antworten",
  answerTo: "Antwort an {by}",
  send: "Senden",
  resolve: "Erledigt",
  reopen: "Wieder öffnen",
  remove: "Löschen",
  none: "Noch keine Kommentare.",
  show: "{element} zeigen",
  whole: "Die Mission",
  gone: "{label} (nicht in dieser Version)",
  resolved: "erledigt von {by}",
  said: "{by}, {at}",
  badge: {
    one: "{count} offener Kommentar zu {element}",
    many: "{count} offene Kommentare zu {element}",
  },
  viewer: "Operatoren und Einsatzleiter kommentieren.",
};
