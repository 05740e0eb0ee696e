// Names of quantities, for people.
import { fill, strings } from "../../strings";
import { unitOf, wordsOf } from "./fields";

export const nameOf = (field: string): string => strings.plots.fields[field] ?? wordsOf(field);

export function titleOf(field: string): string {
  const unit = unitOf(field);
  return unit ? fill(strings.plots.withUnit, { name: nameOf(field), unit }) : nameOf(field);
}
