import type * as english from "../cameras";
import type { Translation } from "../texts";

export const cameras: Translation<typeof english.cameras> = {
  picture: "Was {id} sieht",
  large: "Groß",
  connecting: "wird verbunden…",
  live: "live",
  since: "letztes Bild vor {age}",
  ageless: "angezeigt; Alter nicht bekannt",
  old: "kein Bild seit {age}",
  failed: "kein Bild",
  again: "Erneut in {seconds} s",
  noPicture: "Die Adresse der Kamera liefert kein Bild.",
  noStream:
    "Die Adresse der Kamera ist nicht erreichbar oder lässt diese Seite nicht von ihr lesen.",
  nothingCame: "Verbunden, aber es kam kein Bild.",
  refused: "Die Adresse der Kamera antwortete",
  notMjpeg: "Die Adresse der Kamera liefert kein Motion JPEG.",
  ended: "Der Stream ist zu Ende.",
  noHls: "Dieser Browser spielt kein HLS ab.",
  noPeer: "WebRTC hat keinen Weg zur Kamera gefunden.",
  mixed:
    "Die Seite wird mit TLS (https) ausgeliefert, die Kamera nicht: Browser lehnen das ab.",
};
