// Which signal, message, error or escalation an event throws or catches: chosen by name, shared by
// all events of the file that choose the same. A new name makes a new one.
import { fill, strings } from "../../../strings";
import type { Change } from "../../moddle/extensions";
import { isA, text, type ModdleElement } from "../../moddle/moddle";
import {
  makeRoot,
  referencesOf,
  rootNamed,
  ROOT_TYPES,
  rootsOf,
  type Reference,
  type RootKind,
} from "../../moddle/roots";
import { ComboField } from "../fields/ComboField";
import type { Suggestion } from "../fields/Listbox";
import { CheckField } from "../fields/SelectField";
import { TextField } from "../fields/TextField";
import { apply, definitionsOf, factoryOf, objectOf, set, type FormProps } from "../form";

const words = strings.editor.references;

export function ReferenceForm(form: FormProps) {
  return (
    <>
      {referencesOf(objectOf(form)).map((reference, index) => (
        <ReferenceFields key={index} form={form} reference={reference} index={index} />
      ))}
    </>
  );
}

interface ReferenceProps {
  form: FormProps;
  reference: Reference;
  index: number;
}

function ReferenceFields({ form, reference, index }: ReferenceProps) {
  const { kind, root } = reference;
  const definitions = definitionsOf(form);
  return (
    <>
      <ComboField
        id={`m2-reference-${index}`}
        label={words.kinds[kind]}
        required={kind === "signal" || kind === "message"}
        value={root ? shownName(kind, root) : ""}
        suggestions={suggestionsOf(definitions, kind)}
        hint={
          catchesAll(objectOf(form), kind) && !root ? words.catchesAll[kind as "error"] : words.hint
        }
        write={(name) => refer(form, reference, name.trim())}
      />
      {root && <RootFields form={form} kind={kind} root={root} index={index} />}
    </>
  );
}

function RootFields({
  form,
  kind,
  root,
  index,
}: {
  form: FormProps;
  kind: RootKind;
  root: ModdleElement;
  index: number;
}) {
  const { code } = ROOT_TYPES[kind];
  const write = (properties: Record<string, unknown>) => set(form, root, properties);
  return (
    <>
      <TextField
        id={`m2-reference-name-${index}`}
        label={words.rename}
        value={text(root, "name")}
        hint={fill(words.renameHint, { count: usersOf(definitionsOf(form), root) })}
        write={(name) => write({ name: name.trim() || undefined })}
      />
      {code && (
        <TextField
          id={`m2-reference-code-${index}`}
          label={words.code}
          mono
          value={text(root, code)}
          placeholder={text(root, "id")}
          hint={words.codeHint}
          write={(value) => write({ [code]: value.trim() || undefined })}
        />
      )}
      {(kind === "signal" || kind === "message") && (
        <CheckField
          id={`m2-reference-from-${index}`}
          label={words.fromOperators}
          hint={words.fromHint}
          value={text(root, "m2pem:from") === "operator"}
          write={(sent) => write({ "m2pem:from": sent ? "operator" : undefined })}
        />
      )}
      {kind === "signal" && (
        <ComboField
          id={`m2-reference-returned-${index}`}
          label={words.returned}
          value={text(root, "m2pem:returned")}
          hint={words.returnedHint}
          suggestions={resources(form).map((value) => ({ value }))}
          write={(value) => write({ "m2pem:returned": value.trim() || undefined })}
        />
      )}
      {kind === "message" && (
        <TextField
          id={`m2-reference-correlation-${index}`}
          label={words.correlation}
          mono
          value={text(root, "m2pem:correlationKey")}
          hint={words.correlationHint}
          write={(value) => write({ "m2pem:correlationKey": value.trim() || undefined })}
        />
      )}
      <p class="m2-note m2-mono">{fill(words.id, { id: text(root, "id") })}</p>
    </>
  );
}

function refer(form: FormProps, { kind, holder }: Reference, name: string): void {
  const definitions = definitionsOf(form);
  const { reference } = ROOT_TYPES[kind];
  const changes: Change[] = [];
  let root = name === "" ? undefined : rootNamed(definitions, kind, name);
  if (!root && name !== "") {
    const made = makeRoot(factoryOf(form), definitions, kind, name);
    root = made.root;
    changes.push(made.change);
  }
  apply(form, [...changes, { target: holder, properties: { [reference]: root } }]);
}

function suggestionsOf(definitions: ModdleElement, kind: RootKind): Suggestion[] {
  const { code } = ROOT_TYPES[kind];
  const own = rootsOf(definitions, kind).map((root) => ({
    value: shownName(kind, root),
    note: code && text(root, "name") ? text(root, code) : "",
    group: words.ofThisFile,
  }));
  if (kind !== "error") return own;
  const taken = new Set(rootsOf(definitions, kind).map((root) => text(root, "errorCode")));
  const given = Object.entries(words.codes)
    .filter(([value]) => !taken.has(value))
    .map(([value, note]) => ({ value, note, group: words.thrownByM2pem }));
  return [...own, ...given];
}

function shownName(kind: RootKind, root: ModdleElement): string {
  const { code } = ROOT_TYPES[kind];
  return text(root, "name") || (code ? text(root, code) : "") || text(root, "id");
}

/** A catching error or escalation event without one catches every one. */
function catchesAll(element: ModdleElement, kind: RootKind): boolean {
  const catching = isA(element, "bpmn:BoundaryEvent") || isA(element, "bpmn:StartEvent");
  return catching && (kind === "error" || kind === "escalation");
}

function resources(form: FormProps): string[] {
  const { vehicles, payloads } = form.editor.catalogue.fleet;
  return [...vehicles, ...payloads].map(({ id }) => id);
}

/** How many events and tasks of the file share it. */
function usersOf(definitions: ModdleElement, root: ModdleElement): number {
  let count = 0;
  const waiting = [...((definitions.get("rootElements") as ModdleElement[]) ?? [])];
  for (let each = waiting.pop(); each; each = waiting.pop()) {
    count += referencesOf(each).filter((reference) => reference.root === root).length;
    waiting.push(...((each.get("flowElements") as ModdleElement[] | undefined) ?? []));
  }
  return count;
}
