// One argument of a pattern, as its kind wants it.
import { fill, strings } from "../../../strings";
import { ComboField } from "../../properties/fields/ComboField";
import { CheckField, SelectField } from "../../properties/fields/SelectField";
import { TextField } from "../../properties/fields/TextField";
import { Rows } from "../../properties/forms/Rows";
import type { EditorContext } from "../panel";
import { splitList } from "../../moddle/requirements";
import type { Vocabulary } from "./completion";
import { FormulaField } from "./FormulaField";
import { isList, spaced, type Argument } from "./patterns";
import { decisionsAt } from "./written";

const words = strings.requirements;

export interface ArgumentFieldProps {
  editor: EditorContext;
  vocabulary: Vocabulary;
  id: string;
  argument: Argument;
  /** All that was said of it. */
  values: readonly string[];
  /** The user task that a decision is of. */
  asked: string;
  write(values: readonly string[]): void;
}

export function ArgumentField(props: ArgumentFieldProps) {
  const { argument, id, values, write } = props;
  const label = spaced(argument.name);
  if (!isList(argument.kind)) {
    const put = (value: string) => write(value === "" && !argument.required ? [] : [value]);
    return <SingleField {...props} label={label} value={values[0] ?? ""} put={put} />;
  }
  const parts = values.length === 1 ? splitList(values[0] ?? "") : [...values];
  return (
    <fieldset class="m2v-list">
      <legend>{label}</legend>
      <Rows
        rows={parts}
        write={write}
        add={() => ""}
        addLabel={words.addToList}
        empty={words.listNeeds}
        label={(_, index) => String(index + 1)}
        sortable
        render={(value, index) => (
          <SingleField
            {...props}
            id={`${id}-${index}`}
            label={fill(words.part, { name: label, number: index + 1 })}
            value={value}
            put={(next) => write(parts.with(index, next))}
          />
        )}
      />
      {parts.length < 2 && <p class="m2-field-error">{words.listNeeds}</p>}
    </fieldset>
  );
}

interface SingleFieldProps extends ArgumentFieldProps {
  label: string;
  value: string;
  put(value: string): void;
}

function SingleField(props: SingleFieldProps) {
  const { editor, vocabulary, argument, id, label, value, put, asked } = props;
  const { required } = argument;
  const common = { id, label, required, value, write: put };
  switch (argument.kind) {
    case "condition":
    case "conditions":
      return <FormulaField {...common} vocabulary={vocabulary} isCondition />;
    case "element":
    case "elements":
      return (
        <ComboField
          {...common}
          mono
          suggestions={elementsFor(argument, vocabulary).map(({ id: element, name, type }) => ({
            value: element,
            note: name || type,
          }))}
        />
      );
    case "resource":
      return <SelectField {...common} options={resourceOptions(vocabulary)} />;
    case "behavior":
      return (
        <ComboField
          {...common}
          mono
          suggestions={vocabulary.behaviors.map((name) => ({ value: name }))}
        />
      );
    case "decision":
      return (
        <ComboField
          {...common}
          suggestions={decisionsAt(editor, asked).map((decision) => ({ value: decision }))}
        />
      );
    case "count": {
      const error = /^\d+$/.test(value.trim()) ? undefined : words.wholeNumber;
      return <TextField {...common} error={error} />;
    }
    case "duration":
      return <TextField {...common} hint={words.durationHint} />;
    case "flag":
      return (
        <CheckField
          id={id}
          label={label}
          value={value === "true"}
          write={(on) => put(on ? "true" : "")}
        />
      );
  }
}

/** Only user tasks ask. */
function elementsFor({ name }: Argument, { elements }: Vocabulary): Vocabulary["elements"] {
  return name === "ask" ? elements.filter(({ type }) => type === "userTask") : elements;
}

function resourceOptions({ resources }: Vocabulary) {
  return [
    { value: "", label: words.choose },
    { value: "each", label: words.eachVehicle },
    ...resources.map((each) => ({ value: each, label: each })),
  ];
}
