import type * as english from "../control";
import { OPEN_PLACES } from "../openPlaces";
import type { Translation } from "../texts";

const open = OPEN_PLACES.de;

export const control: Translation<typeof english.control> = {
  group: "Ablauf der Mission",
  open,
  names: {
    first: `${open}: zuerst`,
    also: `${open}: gleichzeitig`,
    body: open,
    then: `${open}: danach`,
    instead: `${open}: stattdessen`,
    fork: "Gleichzeitig",
    join: "Beide sind fertig",
    wait: "{duration} warten",
    until: "Warten bis {date}",
    ready: "Warten, bis es so ist",
    signal: "Weiter",
    stopSignal: "Abbruch",
    decide: "Ist es so?",
    yes: "Ja",
    no: "Nein",
    repeat: "{count}-mal wiederholen",
    every: "Alle {duration}, {count}-mal",
    begin: "Beginn",
    done: "Fertig",
    watch: "Bis etwas erkannt wird",
    both: "Ausführen und beobachten",
    detect: "Beobachten",
    detected: "Erkannt",
    ask: "Operator fragen",
    question: "Weiter?",
    answer: "Antwort?",
    go: "Weiter",
    abort: "Abbrechen",
    failed: "Fehlgeschlagen",
    late: "Nach {duration}",
    askAgain: "Fragen: Es schlug fehl. Erneut versuchen?",
    again: "Erneut versuchen?",
    tryAgain: "Erneut versuchen",
    giveUp: "Aufgeben",
    call: "Andere Mission aufrufen",
  },
  blocks: {
    same: {
      title: "Gleichzeitig",
      doc: "Zwei Dinge beginnen zusammen; die Mission geht weiter, wenn beide fertig sind.",
    },
    wait: { title: "Warten", doc: "Die Mission geht nach einer Zeit weiter." },
    waitFor: { title: "{duration} warten", doc: "Die Mission geht nach einer Zeit weiter." },
    until: {
      title: "Bis zu einer Uhrzeit warten",
      doc: "Die Mission geht zu einem Datum und einer Uhrzeit weiter.",
    },
    ready: {
      title: "Warten, bis etwas wahr ist",
      doc: "Die Mission geht weiter, sobald eine Bedingung an ihre Daten wahr ist.",
    },
    signal: {
      title: "Wenn ein Signal kommt, weiter",
      doc: "Die Mission wartet auf ein Signal eines Operators oder einer anderen Mission.",
    },
    stopSignal: {
      title: "Wenn ein Operator es sagt, abbrechen",
      doc: "Das Ausgewählte wird abgebrochen, wenn ein Signal kommt; dann wird etwas anderes getan.",
    },
    if: { title: "Falls", doc: "Etwas wird nur getan, wenn eine Bedingung wahr ist." },
    repeat: { title: "Wiederholen", doc: "Etwas wird immer wieder getan, so viele Male." },
    repeatFor: {
      title: "{count}-mal wiederholen",
      doc: "Etwas wird immer wieder getan, so viele Male.",
    },
    every: {
      title: "In Abständen",
      doc: "Etwas wird getan, dann vergeht eine Zeit, immer wieder, so viele Male.",
    },
    everyFor: {
      title: "Alle {duration}",
      doc: "Etwas wird getan, dann vergeht eine Zeit, immer wieder, so viele Male.",
    },
    detected: {
      title: "Wenn etwas erkannt wird, abbrechen",
      doc: "Etwas wird getan, während ein Detektor beobachtet. Findet er etwas, wird es abgebrochen und etwas anderes getan.",
    },
    ask: {
      title: "Fragen und entscheiden",
      doc: "Eine Frage an die Operatoren; je nach Antwort geht die Mission weiter oder wird abgebrochen.",
    },
    fails: {
      title: "Falls es fehlschlägt",
      doc: "Wenn das Ausgewählte fehlschlägt, wird etwas anderes getan, und die Mission geht weiter.",
    },
    retry: {
      title: "Erneut versuchen",
      doc: "Wenn etwas fehlschlägt, sagen die Operatoren, ob es erneut versucht wird.",
    },
    within: {
      title: "Innerhalb einer Zeit",
      doc: "Das Ausgewählte wird abgebrochen, wenn es zu lange dauert; dann wird etwas anderes getan.",
    },
    withinFor: {
      title: "Innerhalb von {duration}",
      doc: "Das Ausgewählte wird abgebrochen, wenn es zu lange dauert; dann wird etwas anderes getan.",
    },
    call: {
      title: "Andere Mission aufrufen",
      doc: "Ein anderer Prozess wird von Anfang bis Ende ausgeführt; dann geht dieser weiter.",
    },
  },
};
