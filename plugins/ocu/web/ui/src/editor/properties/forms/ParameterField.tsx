// The field of one parameter, by what kind of value it takes.
import type { Geometry, Parameter } from "../../../shared/types";
import { fill, strings } from "../../../strings";
import { titleOf } from "../../blocks/blocks";
import type { EditorContext } from "../../panels/panel";
import type { Catalogue } from "../../session/catalogue";
import { quantityOf } from "../../session/durations";
import { defaultOf, examine, unitsOf, written, type Wrong } from "../../session/quantities";
import { ComboField } from "../fields/ComboField";
import type { Suggestion } from "../fields/Listbox";
import { TextField } from "../fields/TextField";
import type { FormProps } from "../form";
import { ValueField } from "./ValueField";

const words = strings.editor.parameter;
const GEOMETRIES = ["route", "area", "point"] as const;
const isKind = (kind: string): kind is (typeof GEOMETRIES)[number] =>
  (GEOMETRIES as readonly string[]).includes(kind);

export interface ParameterFieldProps {
  /** `plan`: the map on which a place can be picked. */
  editor: Pick<EditorContext, "catalogue"> & Partial<Pick<EditorContext, "plan">>;
  parameter: Parameter;
  value: string;
  write(value: string): void;
  error?: string | undefined;
  /** Of a mission, where a value may be an expression. */
  form?: FormProps;
}

export function ParameterField(props: ParameterFieldProps) {
  const { editor, form, parameter, value, write, error } = props;
  const wrong = examine(parameter, value);
  const suggestions = suggestionsOf(editor.catalogue, parameter);
  const common = {
    id: `m2-parameter-${parameter.name}`,
    label: titleOf(parameter.name),
    required: parameter.required,
    unit: unitsOf(parameter.kind)[0],
    value,
    write: parameter.kind === "duration" ? (said: string) => write(quantityOf(said)) : write,
    placeholder: defaultOf(parameter) || exampleOf(parameter),
    hint: hintOf(parameter),
    error: error ?? (wrong && describe(wrong)),
  };
  const plain =
    suggestions.length > 0 ? (
      <ComboField {...common} suggestions={suggestions} />
    ) : (
      <TextField {...common} />
    );
  const field = form ? (
    <ValueField form={form} {...common}>
      {plain}
    </ValueField>
  ) : (
    plain
  );
  const { kind } = parameter;
  if (kind !== "position" && !isKind(kind)) return field;
  const { plan } = editor;
  const pick = plan && (
    <button
      type="button"
      class="m2-link-button"
      onClick={() => {
        plan.show(true);
        plan.picking.value = { kind, label: titleOf(parameter.name), write };
      }}
    >
      {strings.plan.pick}
    </button>
  );
  if (kind !== "position") {
    return (
      <>
        {field}
        {pick}
      </>
    );
  }
  return (
    <>
      {field}
      {pick}
      <Coordinates {...{ editor, parameter, value, write }} />
    </>
  );
}

function suggestionsOf(catalogue: Catalogue, parameter: Parameter): Suggestion[] {
  const { kind } = parameter;
  if (parameter.choices.length > 0) return parameter.choices.map((value) => ({ value }));
  if (kind === "boolean")
    return ["true", "false"].map((value) => ({ value, label: words[value as "true"] }));
  if (kind === "position") return [...geometries(catalogue, "point"), ...vehicles(catalogue)];
  if (kind === "vehicle") return vehicles(catalogue);
  return isKind(kind) ? geometries(catalogue, kind) : [];
}

function geometries(catalogue: Catalogue, kind: string): Suggestion[] {
  const found = catalogue.geometries.value.filter((each) => each.kind === kind);
  return found.map((each) => ({
    value: each.name,
    group: words.geometries[each.kind],
    note: noteOf(each),
  }));
}

function noteOf({ from, by }: Geometry): string {
  if (from === "mission") return strings.plan.groups.mission;
  return from === "operator" ? fill(words.byOperator, { by }) : "";
}

function vehicles(catalogue: Catalogue): Suggestion[] {
  return catalogue.fleet.vehicles.map(({ id, domain }) => ({
    value: id,
    group: words.vehicles,
    note: strings.editor.blocks.groups[domain],
  }));
}

function exampleOf(parameter: Parameter): string {
  const [unit] = unitsOf(parameter.kind);
  if (unit) return fill(words.example, { value: `5 ${unit}` });
  if (parameter.kind === "position") return fill(words.example, { value: "[38.107, -77.319, 20]" });
  return "";
}

function hintOf(parameter: Parameter): string {
  const { kind, minimum, maximum } = parameter;
  const range = [
    minimum === null ? "" : fill(words.least, { bound: written(kind, minimum) }),
    maximum === null ? "" : fill(words.most, { bound: written(kind, maximum) }),
  ].filter(Boolean);
  return [parameter.doc, range.join(", ")].filter(Boolean).join(" · ");
}

function describe(wrong: Wrong): string {
  switch (wrong.problem) {
    case "required":
      return words.required;
    case "number":
      return words.noNumber;
    case "whole":
      return words.whole;
    case "unit":
      return wrong.units.length
        ? fill(words.unit, { unit: wrong.unit || words.no, units: wrong.units.join(", ") })
        : fill(words.noUnit, { unit: wrong.unit });
    case "least":
      return fill(words.tooSmall, { bound: wrong.bound });
    case "most":
      return fill(words.tooLarge, { bound: wrong.bound });
    case "choice":
      return fill(words.choice, { choices: wrong.choices.join(", ") });
  }
}

const NUMBERS = /^\s*\[([^\]]*)\]\s*$/;

/** Latitude, longitude and altitude of a position that no point names. */
function Coordinates({ editor, parameter, value, write }: ParameterFieldProps) {
  const [, inside] = NUMBERS.exec(value) ?? [];
  if (inside === undefined) {
    const { lat, lon, alt } = editor.catalogue.fleet.origin;
    void alt;
    return (
      <button type="button" class="m2-link-button" onClick={() => write(`[${lat}, ${lon}, 0]`)}>
        {words.useCoordinates}
      </button>
    );
  }
  const parts = inside.split(",").map((part) => part.trim());
  const replace = (index: number, next: string) => {
    const all = [0, 1, 2].map((at) => (at === index ? next.trim() || "0" : (parts[at] ?? "0")));
    write(`[${all.join(", ")}]`);
  };
  return (
    <div class="m2-coordinates">
      {words.coordinates.map((label, index) => (
        <TextField
          key={label}
          id={`m2-parameter-${parameter.name}-${index}`}
          label={label}
          value={parts[index] ?? ""}
          error={Number.isFinite(Number(parts[index] ?? 0)) ? undefined : words.noNumber}
          write={(next) => replace(index, next)}
        />
      ))}
    </div>
  );
}
