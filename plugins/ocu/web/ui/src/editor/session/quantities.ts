// Values of parameters as people write them: "5 m/s", "45 deg", "${mission.speed}".
// The server reads them too, and has the last word; this says at once what is plainly wrong.
import type { Parameter } from "../../shared/types";

const DISTANCE = { m: 1, cm: 0.01, km: 1000, ft: 0.3048, mi: 1609.344, nmi: 1852 };
const SPEED = { "m/s": 1, "km/h": 1 / 3.6, kn: 1852 / 3600, mph: 0.44704, "ft/s": 0.3048 };

const UNITS: Record<string, Record<string, number>> = {
  duration: { s: 1, ms: 0.001, min: 60, h: 3600 },
  distance: DISTANCE,
  altitude: DISTANCE,
  speed: SPEED,
  angle: { deg: Math.PI / 180, rad: 1 },
  angular_speed: { "deg/s": Math.PI / 180, "rad/s": 1 },
};

const UNIT_NEEDED = new Set(["angle", "angular_speed"]);
const PLAIN = new Set(["number", "count"]);
const QUANTITY = /^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*(\S*)\s*$/i;

/** What is wrong with a value; the texts are in strings.ts. */
export type Wrong =
  | { problem: "required" }
  | { problem: "number" }
  | { problem: "whole" }
  | { problem: "unit"; unit: string; units: string[] }
  | { problem: "least"; bound: string }
  | { problem: "most"; bound: string }
  | { problem: "choice"; choices: string[] };

export function isExpression(value: string): boolean {
  return /[$#]\{/.test(value) || value.trimStart().startsWith("=");
}

/** The units that a kind of parameter may carry; the first is the one people mostly mean. */
export function unitsOf(kind: string): string[] {
  return Object.keys(UNITS[kind] ?? {});
}

export function examine(parameter: Parameter, value: string): Wrong | undefined {
  const said = value.trim();
  if (said === "") return parameter.required ? { problem: "required" } : undefined;
  if (isExpression(said)) return undefined;
  if (parameter.choices.length > 0) {
    const { choices } = parameter;
    return choices.includes(said) ? undefined : { problem: "choice", choices };
  }
  const units = UNITS[parameter.kind];
  if (!units && !PLAIN.has(parameter.kind)) return undefined;
  return examineNumber(parameter, said, units);
}

function examineNumber(
  parameter: Parameter,
  said: string,
  units: Record<string, number> | undefined,
): Wrong | undefined {
  const [, number, unit = ""] = QUANTITY.exec(said) ?? [];
  if (number === undefined) return { problem: "number" };
  const factor = unit === "" && !UNIT_NEEDED.has(parameter.kind) ? 1 : units?.[unit];
  if (factor === undefined) return { problem: "unit", unit, units: unitsOf(parameter.kind) };
  const inSi = Number(number) * factor;
  if (parameter.kind === "count" && !Number.isInteger(inSi)) return { problem: "whole" };
  const { minimum, maximum } = parameter;
  const slack = 1e-9 * Math.max(1, Math.abs(inSi));
  if (minimum !== null && inSi < minimum - slack) {
    return { problem: "least", bound: written(parameter.kind, minimum) };
  }
  if (maximum !== null && inSi > maximum + slack) {
    return { problem: "most", bound: written(parameter.kind, maximum) };
  }
  return undefined;
}

/** A number in SI as people write it: with its unit, angles in degrees. */
export function written(kind: string, inSi: number): string {
  const [unit] = unitsOf(kind);
  if (!unit) return String(rounded(inSi));
  return `${rounded(inSi / (UNITS[kind]?.[unit] ?? 1))} ${unit}`;
}

function rounded(value: number): number {
  return Number(value.toPrecision(6));
}

/** What a parameter's default looks like in a mission; "" when it has none. */
export function defaultOf(parameter: Parameter): string {
  const value = parameter.default;
  if (value === null) return "";
  return typeof value === "number" ? written(parameter.kind, value) : String(value);
}
