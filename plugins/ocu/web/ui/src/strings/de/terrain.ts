import type * as english from "../terrain";
import type { Translation } from "../texts";

export const terrain: Translation<typeof english.terrain> = {
  title: "Höhe über Grund",
  plot: "Das Gelände und die Route über {length}",
  ground: "Gelände",
  route: "Route",
  tooLow: "Unter dem Mindestabstand von {clearance} m",
  lowest: "Dem Grund am nächsten: {height} m, {along} nach ihrem Beginn.",
  low: "Zu niedrig: {height} m über Grund, {along} nach ihrem Beginn; der Mindestabstand der Flotte ist {clearance} m.",
  below: "Die Route verläuft {height} m unter dem Gelände, {along} nach ihrem Beginn.",
  noAltitude:
    "Die Route hat keine Höhen: Geben Sie ihr welche, oder lassen Sie sie dem Gelände folgen.",
  failed: "Das Gelände ist nicht bekannt: {reason}",
  working: "Das Gelände wird gelesen…",
  follow: "Dem Gelände folgen",
  height: "Über Grund, m",
  heightHint: "wie ihre Höhen",
  tolerance: "Auf so viele m genau",
  followed: "{name} folgt dem Gelände: {count} Wegpunkte, Höhen über dem Meeresspiegel.",
};

export const estimates: Translation<typeof english.estimates> = {
  title: "Schätzung",
  sum: "{time} insgesamt",
  working: "…",
  failed: "Es kann nichts geschätzt werden: {reason}",
  none: "Noch keine Aufgabe mit einem Fahrzeug, dessen Weg bekannt ist.",
  table: "Schätzung für jedes Fahrzeug",
  vehicle: "Fahrzeug",
  distance: "Strecke",
  time: "Zeit",
  battery: "Akku am Ende",
  percent: "{percent} %",
  lacks: "reicht nicht",
  belowReserve: "{percent} %, unter der Reserve von {reserve} %",
  assumed:
    "Die Flottendatei sagt nicht, wie lange sein Akku reicht: {endurance} angenommen",
  tasks: "Nach Aufgabe",
  task: "Aufgabe",
  begins: "Beginnt",
  leftOut: "Nicht mitgezählt ({count})",
};
