// What is known of a vehicle or payload, in words.
import { age, fixed, STALE_S } from "../shared/format";
import { timeOfDay } from "../shared/moments";
import { isSelf } from "../people/people";
import { fill, strings } from "../strings";
import type { Column, Row } from "./rows";

const text = strings.fleet;

const percent = (fraction: number): string => `${Math.round(fraction * 100)} %`;

/** The text of a cell. The column of the holder has a link, too. */
export function cellOf(row: Row, column: Column): string {
  switch (column) {
    case "name":
      return row.id;
    case "health":
      return text.health[row.health];
    case "link":
      return linkOf(row);
    case "battery":
      return row.battery === null ? "" : percent(row.battery);
    case "mode":
      return [row.mode, armedOf(row)].filter(Boolean).join(", ");
    case "holder":
      return holderOf(row);
    case "doing":
      return row.status?.held ? `${row.doing} (${text.heldBehavior})` : row.doing;
    case "speed":
      return row.speed === null ? "" : `${fixed(row.speed, 1)} m/s`;
    case "height":
      return row.height_m === null ? "" : `${fixed(row.height_m, 1)} m`;
    case "failsafe":
      return row.isPayload ? "" : failsafeOf(row);
    case "position":
      return row.latitude === null || row.longitude === null
        ? ""
        : `${row.latitude.toFixed(6)}, ${row.longitude.toFixed(6)}`;
  }
}

export function armedOf({ armed }: Row): string {
  if (armed === null) return "";
  return armed ? text.armed : text.disarmed;
}

function failsafeOf({ failsafe, failsafeProblems }: Row): string {
  if (!failsafe) return text.noFailsafe;
  if (failsafeProblems === null) return failsafe;
  const { failsafeCompared, failsafeDiffers } = text;
  return fill(failsafeProblems.length > 0 ? failsafeDiffers : failsafeCompared, { failsafe });
}

function linkOf({ link, age_s, unknownSince }: Row): string {
  if (unknownSince !== null) {
    return fill(strings.shell.unknownSince, { time: timeOfDay(unknownSince) });
  }
  if (age_s === null) return text.links.unknown;
  const silent = age_s > STALE_S ? fill(text.silent, { age: age(age_s) }) : "";
  if (!silent) return text.links[link];
  return link === "lost" ? `${text.links.lost}, ${silent}` : silent;
}

/** Without the run that commands it. */
export function holderOf({ operator, status, manned }: Row): string {
  if (operator) {
    return isSelf(operator) ? text.withYou : fill(text.with, { by: operator });
  }
  if (status?.run) return "";
  if (status?.unavailable) return status.unavailable;
  return manned ? text.manned : text.free;
}
