// Which process a call activity calls, and what passes in and out.
import { strings } from "../../../strings";
import { isA, list, text, type ModdleElement } from "../../moddle/moddle";
import { mappingsOf, setMappings, type Direction, type Mapping } from "../../moddle/mappings";
import { ComboField } from "../fields/ComboField";
import { TextField } from "../fields/TextField";
import { apply, definitionsOf, factoryOf, objectOf, set, type FormProps } from "../form";
import { Rows } from "./Rows";
import { ValueField } from "./ValueField";

const words = strings.editor.call;
const CALLABLE = [
  "bpmn:Process",
  "bpmn:GlobalTask",
  "bpmn:GlobalUserTask",
  "bpmn:GlobalScriptTask",
  "bpmn:GlobalManualTask",
  "bpmn:GlobalBusinessRuleTask",
];

export function CallForm(form: FormProps) {
  const call = objectOf(form);
  const called = text(call, "calledElement");
  const callable = list(definitionsOf(form), "rootElements").filter((each) =>
    CALLABLE.some((type) => each.$type === type),
  );
  const isHere = callable.some((each) => text(each, "id") === called);
  return (
    <>
      <ComboField
        id="m2-called"
        label={words.called}
        required
        value={called}
        suggestions={callable
          .filter((each) => each !== processOf(call))
          .map((each) => ({ value: text(each, "id"), note: text(each, "name") }))}
        hint={called && !isHere ? words.elsewhere : words.hint}
        error={called === "" ? words.missing : undefined}
        write={(id) => set(form, call, { calledElement: id.trim() || undefined })}
      />
      {isHere && (
        <button
          type="button"
          class="m2-link-button"
          onClick={() => void form.editor.select(called)}
        >
          {words.open}
        </button>
      )}
      <Mappings form={form} direction="in" />
      <Mappings form={form} direction="out" />
    </>
  );
}

function Mappings({ form, direction }: { form: FormProps; direction: Direction }) {
  const call = objectOf(form);
  const mappings = mappingsOf(call, direction);
  const names = (form.editor.checks.outline.value?.names ?? []).map(({ name }) => ({
    value: name,
  }));
  const write = (next: Mapping[]) =>
    apply(form, setMappings(factoryOf(form), call, direction, next));
  const source = (row: Mapping, index: number) => ({
    id: `m2-${direction}-source-${index}`,
    label: words.source,
    required: true,
    value: row.source,
    write: (said: string) => write(mappings.with(index, { ...row, source: said.trim() })),
  });
  return (
    <>
      <h2 class="m2-heading">{words[direction]}</h2>
      <Rows
        rows={mappings}
        write={write}
        add={() => ({ source: "", target: "" })}
        addLabel={words.add[direction]}
        empty={words.nothing[direction]}
        label={({ source, target }) => `${source || "?"} → ${target || "?"}`}
        render={(row, index) => (
          <>
            <ValueField form={form} {...source(row, index)}>
              <ComboField
                {...source(row, index)}
                mono
                suggestions={direction === "in" ? names : []}
              />
            </ValueField>
            <TextField
              id={`m2-${direction}-target-${index}`}
              label={words.target}
              required
              mono
              value={row.target}
              write={(target) => write(mappings.with(index, { ...row, target: target.trim() }))}
            />
          </>
        )}
      />
    </>
  );
}

function processOf(element: ModdleElement): ModdleElement | undefined {
  let at: ModdleElement | undefined = element;
  while (at && !isA(at, "bpmn:Process")) at = at.$parent;
  return at;
}
