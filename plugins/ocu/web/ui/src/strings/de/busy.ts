import type * as english from "../busy";
import type { Translation } from "../texts";

export const busy: Translation<typeof english.busy> = {
  title: "Fahrzeuge sind belegt",
  text: "Andere haben Fahrzeuge, die {mission} nennt:",
  vehicle: "Fahrzeug",
  holder: "Belegt von",
  does: "Tut",
  operator: "{who}, von Hand",
  nothing: "von der Mission genannt, derzeit von keiner Aufgabe belegt",
  free: "jetzt frei",
  wait: "In die Warteschlange",
  waitHint:
    "„In die Warteschlange“ startet sie, sobald alle ihre Fahrzeuge frei sind.",
  queued: "{mission} wartet als {entry}, bis ihre Fahrzeuge frei sind.",
  choose: "Andere Fahrzeuge wählen",
  chooseHint:
    "Wählen Sie eine Aufgabe aus und geben Sie ihr ein anderes Fahrzeug. „Wird beim Start der Aufgabe gewählt“ nimmt ein freies, das passt.",
  stop: "{run} stoppen…",
  stopSure: "{run} stoppen: Die Mission endet",
  stopping: "{run} wird gestoppt. Seine Fahrzeuge sind frei, wenn sie angehalten haben.",
  start: "Jetzt starten",
  startHint:
    "„Trotzdem starten“ startet sie sofort. Eine Aufgabe, deren Fahrzeug belegt ist, wartet dann, schlägt fehl oder nimmt es nach ihrer Priorität, wie Mission und Flotte es bestimmen.",
  yes: "Trotzdem starten",
  no: "Nicht starten",
};
