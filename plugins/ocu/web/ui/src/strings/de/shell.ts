import type * as english from "../shell";
import type { Translation } from "../texts";

export const shell: Translation<typeof english.shell> = {
  title: "m2pem",
  skip: "Zum Inhalt der Seite",
  fleet: "Flotte",
  simulated: "Simuliert",
  simulatedHint: "Nichts bewegt sich wirklich: Alle Fahrzeuge sind simuliert",
  real: "ECHTE FAHRZEUGE",
  realHint: "Fahrzeuge dieser Flotte sind echt. Sie bewegen sich.",
  stop: "STOP",
  stopAgain: "Nochmals: STOP",
  stopHint:
    "STOP aller Läufe und aller Fahrzeuge, die ein Lauf steuert: zweimal klicken oder gedrückt halten; zweimal Umschalt+Escape",
  stopAllRuns: "allen Läufen",
  stopOneRun: "Lauf {run}",
  stopDelivered: "STOP von {what} wurde zugestellt.",
  stopLate: "STOP von {what} wurde {age} s nach dem Auslösen zugestellt.",
  stopUndelivered: "STOP wurde NICHT zugestellt.",
  stopRetried:
    "Die Missionssteuerung hat STOP von {what} nicht bestätigt. Es wird weiter gesendet, bis sie es tut.",
  stopRefused: "Die Missionssteuerung lehnt STOP von {what} ab.",
  stopOtherwise:
    "Halten Sie die Fahrzeuge anders an: m2pem stop --all in einem Terminal auf dem Rechner der Missionssteuerung, oder der Nothalt jedes Fahrzeugs.",
  stopGiveUp: "Dieses STOP aufgeben",
  notSent: "Nicht verbunden: Es wurde nichts gesendet.",
  notConfirmed:
    "Keine Antwort innerhalb der Zeitgrenze. Was später ankommt, wird abgelehnt: Prüfen Sie die Anzeige, sobald die Verbindung wieder besteht.",
  // It is written into the journal, which operators of every language read.
  stopReason: "STOP on the web page",
  home: "Missionen",
  fleetPage: "Flotte",
  pages: "Seiten",
  signedInAs: "Angemeldet als",
  roles: { viewer: "Beobachter", operator: "Operator", commander: "Einsatzleiter" },
  signOut: "Abmelden",
  settings: "Einstellungen",
  connected: "Mit der Missionssteuerung verbunden.",
  connecting: "Verbindung zur Missionssteuerung wird hergestellt…",
  offline: "Keine Verbindung zur Missionssteuerung. Die Anzeige kann veraltet sein.",
  unknownSince: "unbekannt seit {time}",
  offlineShort: "Nicht verbunden",
  retry: "Jetzt versuchen",
  standby: "Bereitschaft:",
  process: "Prozess {pid} auf {host}",
  noStandby: "Keine in Bereitschaft.",
  questions: "offene Fragen",
  question: "offene Frage",
  loading: "Wird geladen…",
  notLoaded:
    "Dieser Teil der Seite konnte nicht geladen werden. Er wird geladen, sobald die Missionssteuerung wieder antwortet.",
  earlierMessages: {
    one: "1 frühere Meldung steht in der Liste der Alarme",
    many: "{count} frühere Meldungen stehen in der Liste der Alarme",
  },
  dismiss: "Ausblenden",
  close: "Schließen",
  fault: "Fehler",
};

export const signIn: Translation<typeof english.signIn> = {
  title: "Anmelden",
  name: "Name",
  password: "Passwort",
  submit: "Anmelden",
  hint: "Öffnen Sie auf dem Rechner der Missionssteuerung die Adresse, die sie ausgegeben hat, oder eine neue:",
  command: "m2pem web url",
  wrong: "Name oder Passwort ist falsch.",
  refused: {
    token: "Diese Adresse wurde schon benutzt oder ist zu alt. Fordern Sie eine neue an.",
    attempts: "Das waren zu viele Versuche. Versuchen Sie es in fünf Minuten erneut.",
    key: "Dieser Browser hat den Schlüssel seiner Sitzung verloren. Melden Sie sich erneut an.",
  },
  unreachable: "Die Missionssteuerung antwortet nicht.",
};
