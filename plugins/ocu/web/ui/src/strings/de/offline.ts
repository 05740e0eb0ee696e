import type * as english from "../offline";
import type { Translation } from "../texts";

export const offline: Translation<typeof english.offline> = {
  title: "Keine Verbindung zur Missionssteuerung",
  again: "Die Seite versucht es alle zwei Sekunden erneut.",
  noStop: "STOP kann von hier nicht gesendet werden.",
  seen: "Was dieser Browser zuletzt sah, {when}:",
  ago: "vor {age}",
  runs: "Läufe, die da im Gang waren. Sie gehen ohne diese Seite weiter oder sind inzwischen zu Ende:",
  noRuns: "Da war kein Lauf im Gang.",
  nothing: "Dieser Browser war noch nicht verbunden.",
};
