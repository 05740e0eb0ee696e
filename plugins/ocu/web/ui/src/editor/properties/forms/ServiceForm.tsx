// Which service a service task calls, with what properties.
import { fill, strings } from "../../../strings";
import { serviceOf, setService, type ServiceUse } from "../../moddle/behavior";
import { ComboField } from "../fields/ComboField";
import { TextField } from "../fields/TextField";
import { apply, factoryOf, objectOf, type FormProps } from "../form";
import { Rows } from "./Rows";
import { ValueField } from "./ValueField";

const words = strings.editor.service;
type Row = ServiceUse["parameters"][number];
const NOTHING: ServiceUse = { name: "", parameters: [], roles: [] };

export function ServiceForm(form: FormProps) {
  const task = objectOf(form);
  const use = serviceOf(task) ?? NOTHING;
  const { services } = form.editor.catalogue;
  const known = services.find(({ name }) => name === use.name);
  const write = (next: ServiceUse) => apply(form, setService(factoryOf(form), task, next));
  const valueOf = (row: Row, index: number) => ({
    id: `m2-service-value-${index}`,
    label: words.propertyValue,
    value: row.value,
    write: (value: string) =>
      write({ ...use, parameters: use.parameters.with(index, { ...row, value }) }),
  });
  return (
    <>
      <ComboField
        id="m2-service"
        label={words.class}
        required
        value={use.name}
        suggestions={services.map(({ name, writes }) => ({
          value: name,
          note: writes.length ? fill(words.writes, { names: writes.join(", ") }) : "",
        }))}
        error={use.name && !known ? fill(words.unknown, { name: use.name }) : undefined}
        hint={
          known?.writes.length ? fill(words.writes, { names: known.writes.join(", ") }) : undefined
        }
        write={(name) => write({ ...use, name: name.trim() })}
      />
      <Rows
        rows={use.parameters}
        write={(parameters) => write({ ...use, parameters })}
        add={() => ({ name: words.newProperty, value: "" })}
        addLabel={words.addProperty}
        empty={words.noProperties}
        label={({ name }) => name}
        render={(row, index) => (
          <>
            <TextField
              id={`m2-service-name-${index}`}
              label={words.propertyName}
              value={row.name}
              write={(name) =>
                write({ ...use, parameters: use.parameters.with(index, { ...row, name }) })
              }
            />
            <ValueField form={form} {...valueOf(row, index)}>
              <TextField {...valueOf(row, index)} />
            </ValueField>
          </>
        )}
      />
    </>
  );
}
