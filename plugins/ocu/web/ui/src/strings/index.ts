// Every text that a person reads, one section a page.
import { cameras } from "./cameras";
import { requirements, verify } from "./checks";
import { control } from "./control";
import { alerts } from "./alerts";
import { busy } from "./busy";
import { editor } from "./editor";
import { fleet } from "./fleet";
import { home } from "./home";
import { operate } from "./operate";
import { plots } from "./plots";
import { people } from "./people";
import { plan } from "./plan";
import { runs } from "./runs";
import { begin, run } from "./run";
import { shell, signIn } from "./shell";

export const strings = {
  shell,
  signIn,
  home,
  busy,
  alerts,
  people,
  editor,
  plan,
  control,
  verify,
  requirements,
  run,
  runs,
  begin,
  operate,
  plots,
  fleet,
  cameras,
};

/** `{name}` in a text becomes its value. */
export function fill(text: string, values: Record<string, string | number>): string {
  return text.replace(/\{(\w+)\}/g, (whole, name: string) => String(values[name] ?? whole));
}

/** A text for one thing, and one for any other number of them. */
export function counted(
  texts: { readonly one: string; readonly many: string },
  count: number,
  values: Record<string, string | number> = {},
): string {
  return fill(count === 1 ? texts.one : texts.many, { count, ...values });
}
