// Every text that a person reads, one section a page.
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

export const english = {
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

export type English = typeof english;
