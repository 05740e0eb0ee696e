// Name, id and documentation of whatever is selected.
import { getLabel } from "bpmn-js/lib/features/label-editing/LabelUtil";
import { strings } from "../../../strings";
import { adopt, child, isA, list, text, type ModdleElement } from "../../moddle/moddle";
import { CheckField } from "../fields/SelectField";
import { TextField } from "../fields/TextField";
import { factoryOf, objectOf, set, type FormProps } from "../form";

const words = strings.editor.general;
const ID = /^[\p{L}_][\p{L}\p{N}_.-]*$/u;

export function GeneralForm(form: FormProps) {
  const object = objectOf(form);
  const pool = isA(object, "bpmn:Participant") ? child(object, "processRef") : undefined;
  const process = pool ?? (isA(object, "bpmn:Process") ? object : undefined);
  return (
    <>
      {object.$descriptor.name !== "bpmn:Collaboration" && <NameField form={form} />}
      <IdField form={form} target={object} label={pool ? words.poolId : words.id} />
      {pool && <IdField form={form} target={pool} label={words.processId} />}
      {process && (
        <CheckField
          id="m2-executable"
          label={words.executable}
          hint={words.executableHint}
          value={process.get("isExecutable") === true}
          write={(isExecutable) => set(form, process, { isExecutable })}
        />
      )}
      <TextField
        id="m2-documentation"
        label={words.documentation}
        rows={3}
        value={documentationOf(object)}
        write={(body) => set(form, object, { documentation: documentation(form, object, body) })}
      />
    </>
  );
}

function NameField({ form }: { form: FormProps }) {
  const { element, editor } = form;
  const isNote = isA(objectOf(form), "bpmn:TextAnnotation");
  const modeling = editor.service("modeling");
  // A group and a note have no name: what is written there is what the canvas shows.
  const isLabel = isNote || isA(objectOf(form), "bpmn:Group");
  return (
    <TextField
      id="m2-name"
      label={isNote ? words.text : words.name}
      rows={isNote ? 3 : 2}
      value={isLabel ? (getLabel(element as never) ?? "") : text(objectOf(form), "name")}
      write={(name) => {
        if (isLabel) modeling.updateLabel(element as never, name);
        else modeling.updateProperties(element as never, { name: name || undefined });
      }}
    />
  );
}

interface IdProps {
  form: FormProps;
  target: ModdleElement;
  label: string;
}

function IdField({ form, target, label }: IdProps) {
  const id = text(target, "id");
  const write = (next: string) => {
    const said = next.trim();
    if (isWrong(target, said)) return;
    if (target === objectOf(form)) {
      form.editor.service("modeling").updateProperties(form.element as never, { id: said });
    } else {
      set(form, target, { id: said });
    }
  };
  return (
    <TextField
      id={`m2-id-${label}`}
      label={label}
      mono
      value={id}
      hint={words.idHint}
      write={write}
    />
  );
}

interface Ids {
  assigned(id: string): unknown;
}

/** No id that XML allows, or that of another element. */
function isWrong(target: ModdleElement, id: string): boolean {
  if (!ID.test(id)) return true;
  const { ids } = (target as ModdleElement & { $model: { ids: Ids } }).$model;
  const owner = ids.assigned(id);
  return Boolean(owner) && owner !== target;
}

function documentationOf(object: ModdleElement): string {
  const [first] = list(object, "documentation");
  return first ? text(first, "text") : "";
}

function documentation(form: FormProps, object: ModdleElement, body: string): ModdleElement[] {
  const more = list(object, "documentation").slice(1);
  if (body.trim() === "") return more;
  const made = factoryOf(form).create("bpmn:Documentation", { text: body });
  adopt(object, made);
  return [made, ...more];
}
