// The texts in German.
//
// Words: mission = Mission, run = Lauf, executive = Missionssteuerung, operator = Operator,
// commander = Einsatzleiter, viewer = Beobachter, vehicle = Fahrzeug, payload = Nutzlast,
// fleet = Flotte, team = Team, arbiter = Arbiter, take over / give back = übernehmen / zurückgeben,
// hold / resume = anhalten / fortsetzen, link = Verbindung, alert = Alarm, acknowledge = quittieren,
// incident = Störung, survey = Vermessung, pass = Bahn, rehearsal = Probelauf, verification = Verifikation, check = Prüfung,
// replay = Wiedergabe, schedule = Zeitplan, draft = Entwurf, route / area / point = Route / Gebiet /
// Punkt, survey = Vermessung, pass = Bahn, ground / terrain = Gelände, vertex = Stützpunkt, footprint = Sichtfeld, log = Protokoll, time line = Zeitleiste.
// STOP has one name on every device, and keeps it.
//
// BPMN: task = Aufgabe, gateway = Gateway, sequence flow = Sequenzfluss, start / end / boundary event =
// Startereignis / Endereignis / angeheftetes Ereignis, call activity = Aufrufaktivität, subprocess =
// Teilprozess, signal = Signal, message = Nachricht, error = Fehler, escalation = Eskalation,
// token = Token, pool = Pool, data object = Datenobjekt, multi-instance = Mehrfachinstanz.
import type { English } from "../english";
import type { Translation } from "../texts";
import { alerts } from "./alerts";
import { busy } from "./busy";
import { cameras } from "./cameras";
import { requirements, verify } from "./checks";
import { comments } from "./comments";
import { compare } from "./compare";
import { control } from "./control";
import { debug } from "./debug";
import { editor } from "./editor";
import { fleet } from "./fleet";
import { home } from "./home";
import { monitors } from "./monitors";
import { offline } from "./offline";
import { operate } from "./operate";
import { people } from "./people";
import { plan } from "./plan";
import { plots } from "./plots";
import { begin, run } from "./run";
import { revise } from "./revise";
import { runs } from "./runs";
import { settings } from "./settings";
import { shell, signIn } from "./shell";
import { survey } from "./survey";
import { estimates, terrain } from "./terrain";

export const german: Translation<English> = {
  shell,
  settings,
  offline,
  signIn,
  home,
  busy,
  alerts,
  people,
  comments,
  compare,
  editor,
  plan,
  survey,
  terrain,
  estimates,
  control,
  verify,
  requirements,
  run,
  revise,
  runs,
  begin,
  operate,
  monitors,
  debug,
  plots,
  fleet,
  cameras,
};
