// What a role needs of the vehicle or payload that is chosen for it, and how long its task waits.
import { strings } from "../../../strings";
import { isByNeed, NEEDS, WAITS, type Need, type NeedName, type Role } from "../../moddle/behavior";
import { DurationField } from "../fields/DurationField";
import { TextField } from "../fields/TextField";
import type { FormProps } from "../form";
import { ExpressionField } from "./ExpressionField";

const words = strings.editor.roles.needs;

export interface NeedFieldsProps {
  form: FormProps;
  index: number;
  role: Role;
  write(need: Need): void;
}

export function NeedFields({ form, index, role, write }: NeedFieldsProps) {
  const need = role.need ?? {};
  const byNeed = isByNeed(role);
  const further = byNeed ? NEEDS.filter((name) => name !== "requires") : WAITS;
  const change = (name: NeedName, value: string) => {
    const { [name]: _, ...others } = need;
    write(value.trim() === "" ? others : { ...others, [name]: value.trim() });
  };
  const field = (name: NeedName) => {
    const common = {
      id: `m2-role-${name}-${index}`,
      label: words[name].label,
      hint: words[name].hint,
      value: need[name] ?? "",
      write: (value: string) => change(name, value),
    };
    if (name === "wait") return <DurationField key={name} {...common} others={["unlimited"]} />;
    return name === "requires" || name === "prefer" ? (
      <ExpressionField key={name} form={form} {...common} />
    ) : (
      <TextField key={name} mono {...common} />
    );
  };
  return (
    <>
      {byNeed && field("requires")}
      <details class="m2-further">
        <summary>{byNeed ? words.further : words.waiting}</summary>
        {further.map(field)}
      </details>
    </>
  );
}
