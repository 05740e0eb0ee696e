// The form for what a run begins with.
import { fill, strings } from "../../../strings";
import { SelectField } from "../../properties/fields/SelectField";
import type { EditorContext } from "../panel";
import { beginningOf, problemOf, wanted, type Given } from "./beginning";
import { readValue } from "./values";

const words = strings.begin;

export interface BeginFormProps {
  editor: EditorContext;
  /** In front of the ids of its fields: the form is in several panels. */
  prefix: string;
}

export function BeginForm({ editor, prefix }: BeginFormProps) {
  const beginning = beginningOf(editor);
  const outline = editor.checks.outline.value;
  const processes = outline?.processes ?? [];
  const main = processes.find((each) => each.starts);
  const title = ({ id, name }: { id: string; name: string }) =>
    name && name !== id ? `${name} (${id})` : id;
  const mainLabel = main ? fill(words.main, { process: title(main) }) : words.mainUnknown;
  const rows = beginning.given.value;
  const write = (next: readonly Given[]) => {
    beginning.given.value = next;
  };
  const offered = wanted(outline, rows);
  return (
    <>
      <SelectField
        id={`${prefix}-process`}
        label={words.process}
        value={beginning.process.value}
        options={[
          { value: "", label: mainLabel },
          ...processes.map((each) => ({ value: each.id, label: title(each) })),
        ]}
        write={(process) => {
          beginning.process.value = process;
        }}
      />
      <fieldset class="m2v-data">
        <legend>{words.data}</legend>
        {rows.map((row, index) => (
          <GivenRow
            key={index}
            id={`${prefix}-data-${index}`}
            row={row}
            problem={problemText(rows, index)}
            change={(next) => write(rows.with(index, next))}
            remove={() => write(rows.toSpliced(index, 1))}
          />
        ))}
        {offered.length > 0 && (
          <p class="m2v-offered">
            <span>{words.wanted}</span>
            {offered.map((name) => (
              <button
                key={name}
                type="button"
                class="m2v-chip"
                onClick={() => write([...rows, { name, written: "" }])}
              >
                + {name}
              </button>
            ))}
          </p>
        )}
        <button
          type="button"
          class="m2-button"
          onClick={() => write([...rows, { name: "", written: "" }])}
        >
          {words.add}
        </button>
      </fieldset>
    </>
  );
}

interface GivenRowProps {
  id: string;
  row: Given;
  problem: string | undefined;
  change(row: Given): void;
  remove(): void;
}

function GivenRow({ id, row, problem, change, remove }: GivenRowProps) {
  const { kind } = readValue(row.written);
  const described = problem ? `${id}-problem` : `${id}-kind`;
  return (
    <div class="m2v-given">
      <input
        class="m2-input m2-mono"
        aria-label={words.name}
        placeholder={words.name}
        value={row.name}
        spellcheck={false}
        autocomplete="off"
        onInput={(event) => change({ ...row, name: event.currentTarget.value })}
      />
      <span aria-hidden="true">=</span>
      <input
        class="m2-input m2-mono"
        aria-label={row.name ? fill(words.valueOf, { name: row.name }) : words.value}
        placeholder={words.value}
        value={row.written}
        spellcheck={false}
        autocomplete="off"
        aria-invalid={problem ? "true" : undefined}
        aria-describedby={described}
        onInput={(event) => change({ ...row, written: event.currentTarget.value })}
      />
      <button
        type="button"
        class="m2-icon-button"
        aria-label={fill(words.remove, { name: row.name || words.name })}
        title={fill(words.remove, { name: row.name || words.name })}
        onClick={remove}
      >
        ×
      </button>
      {problem ? (
        <p class="m2-field-error" id={`${id}-problem`}>
          {problem}
        </p>
      ) : (
        <p class="m2v-kind" id={`${id}-kind`}>
          {words.kinds[kind]}
        </p>
      )}
    </div>
  );
}

function problemText(rows: readonly Given[], index: number): string | undefined {
  const problem = problemOf(rows, index);
  return problem && words.problems[problem];
}
