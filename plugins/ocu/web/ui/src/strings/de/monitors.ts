import type * as english from "../monitors";
import type { Translation } from "../texts";

export const monitors: Translation<typeof english.monitors> = {
  title: "Anforderungen",
  titleViolated: "{count} verletzt",
  none: "Der Lauf wird auf keine Anforderungen überwacht.",
  states: {
    open: "offen",
    satisfied: "erfüllt",
    violated: "verletzt",
  },
  openHint: "noch nicht entschieden: was noch kommt, kann sie erfüllen oder verletzen",
  neverDecided: "nicht entschieden, und der Lauf ist zu Ende",
  since: "seit {time}",
  openBecause: "Warum sie offen ist: {because}",
  because: "Wodurch das feststeht: {because}",
  throws: {
    error: "Eine Verletzung wirft den Fehler {name} in der Mission.",
    signal: "Eine Verletzung wirft das Signal {name} in der Mission.",
  },
  elements: "Elemente",
  formula: "Formel",
  show: "Ihre Elemente zeigen",
  showAt: "Ihre Elemente zeigen und zu {time} gehen",
  violated: { one: "{count} Anforderung verletzt", many: "{count} Anforderungen verletzt" },
  open: "Anforderungen zeigen",
  element: "verletzt Anforderung {names}",
  legend: "eine verletzte Anforderung handelt davon",
};
