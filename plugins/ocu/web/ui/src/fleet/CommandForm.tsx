// The parameters of a behavior that is commanded to vehicles. A position is picked on the map.
import { useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { titleOf } from "../editor/blocks/blocks";
import { ParameterField } from "../editor/properties/forms/ParameterField";
import type { Catalogue } from "../editor/session/catalogue";
import { examine } from "../editor/session/quantities";
import type { Behavior, Parameter } from "../shared/types";
import { counted, fill, strings } from "../strings";
import { accepted, namesOf, order, sending, type Order } from "./commands";
import { isComplete } from "./offers";
import { destination, middle, picking } from "./state";
import "../editor/forms.css";

const text = strings.fleet.commands;

export interface CommandFormProps {
  catalogue: Catalogue;
  behavior: Behavior;
  resources: readonly string[];
  onClose: () => void;
}

/** Degrees: a centimetre or so. */
const position = (latitude: number, longitude: number): string =>
  `[${latitude.toFixed(7)}, ${longitude.toFixed(7)}]`;

const PICKED = /^\s*\[\s*(-?[\d.]+)\s*,\s*(-?[\d.]+)/;

export function CommandForm({ catalogue, behavior, resources, onClose }: CommandFormProps) {
  const values = useSignal<Record<string, string>>({});
  const form = useRef<HTMLFormElement>(null);
  /** The order that this form has given: when it is carried out, the form closes. */
  const given = useRef<Order | null>(null);
  const place = behavior.parameters.find(({ kind }) => kind === "position");
  const write = (name: string, value: string) => {
    values.value = { ...values.peek(), [name]: value };
    const [, latitude, longitude] = (name === place?.name && PICKED.exec(value)) || [];
    if (name === place?.name) {
      destination.value =
        latitude && longitude ? [Number(latitude), Number(longitude)] : null;
    }
  };
  const pick = () => {
    if (!place) return;
    picking.value = {
      behavior: titleOf(behavior.name),
      parameter: titleOf(place.name),
      picked: (latitude, longitude) => {
        write(place.name, position(latitude, longitude));
        // It is given next.
        requestAnimationFrame(() =>
          form.current?.querySelector(".primary")?.scrollIntoView({ block: "nearest" }),
        );
      },
    };
  };
  useEffect(() => {
    pick();
    form.current?.querySelector<HTMLElement>("input, select, button")?.focus();
    form.current?.scrollIntoView({ block: "nearest" });
    const stop = accepted.subscribe((done) => {
      if (done !== null && done === given.current) onClose();
    });
    return () => {
      stop();
      picking.value = null;
      destination.value = null;
    };
  }, [behavior]);

  const [first, further] = useMemo(() => {
    const oneOf = new Set(behavior.required_one_of.flat());
    const isFirst = ({ name, required }: Parameter) => required || oneOf.has(name);
    const { parameters } = behavior;
    return [parameters.filter(isFirst), parameters.filter((each) => !isFirst(each))];
  }, [behavior]);
  const field = (parameter: Parameter) => (
    <ParameterField
      key={parameter.name}
      editor={{ catalogue }}
      parameter={parameter}
      value={values.value[parameter.name] ?? ""}
      write={(value) => write(parameter.name, value)}
    />
  );
  const isRight = () =>
    isComplete(behavior, values.value) &&
    behavior.parameters.every((each) => !examine(each, values.value[each.name] ?? ""));
  const submit = (event: Event) => {
    event.preventDefault();
    // What is typed is part of the form when the field is left.
    if (document.activeElement instanceof HTMLInputElement) document.activeElement.blur();
    if (!isRight()) return;
    const said = Object.entries(values.value).filter(([, value]) => value.trim() !== "");
    const parameters = Object.fromEntries(said);
    picking.value = null;
    given.current = {
      verb: "execute",
      resources,
      behavior: { name: behavior.name, title: titleOf(behavior.name), parameters },
    };
    void order(given.current);
  };
  const title = fill(text.parameters, {
    behavior: titleOf(behavior.name),
    name: namesOf(resources),
  });
  return (
    <form
      ref={form}
      class="fleet-form"
      aria-label={title}
      onSubmit={submit}
      onKeyDown={(event) => {
        if (event.key === "Escape" && !event.shiftKey) onClose();
      }}
    >
      <h3>{title}</h3>
      {behavior.doc && <p class="m2-note">{behavior.doc}</p>}
      {first.map(field)}
      {place && (
        <p class="fleet-buttons">
          <button type="button" class="secondary" aria-pressed={!!picking.value} onClick={pick}>
            {text.pick}
          </button>
          <button
            type="button"
            class="secondary"
            onClick={() => {
              const at = middle.current();
              if (at) write(place.name, position(...at));
            }}
          >
            {text.centre}
          </button>
        </p>
      )}
      {further.length > 0 && (
        <details class="m2-further">
          <summary>{counted(text.optional, further.length)}</summary>
          {further.map(field)}
        </details>
      )}
      {!behavior.ends && <p class="m2-note">{text.endless}</p>}
      <p class="fleet-buttons">
        <button class="primary" disabled={!isRight() || sending.value !== null}>
          {text.give}
        </button>
        <button type="button" class="secondary" onClick={onClose}>
          {text.cancel}
        </button>
        {!isRight() && <small>{text.incomplete}</small>}
      </p>
    </form>
  );
}
