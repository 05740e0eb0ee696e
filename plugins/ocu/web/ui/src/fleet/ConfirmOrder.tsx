// Before a command to many vehicles, or one that ends something: whom it concerns, and what it ends.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { Dialog } from "../shared/Dialog";
import { fill, strings } from "../strings";
import { asked, namesOf, send, type Effect, type Order } from "./commands";
import "./confirm.css";

const text = strings.fleet.commands;

export function ConfirmOrder() {
  const now = asked.value;
  useEffect(() => () => void (asked.value = null), []); // another page does not ask it
  if (!now) return null;
  return <Asked order={now.order} effects={now.effects} />;
}

function Asked({ order, effects }: { order: Order; effects: readonly Effect[] | null }) {
  const confirm = useRef<HTMLButtonElement>(null);
  const { verb, resources, behavior } = order;
  const takes = effects?.some(({ take, problem }) => take && !problem) ?? false;
  const title = fill(text.verbs[verb], {
    names: namesOf(resources),
    behavior: behavior?.title ?? "",
  });
  const isTaking = takes && (verb === "hold" || verb === "execute");
  const label = isTaking
    ? fill(text.confirmTaking, { act: text.acts[verb as "hold"] })
    : text.confirm[verb];
  useLayoutEffect(() => {
    if (effects) confirm.current?.focus();
  }, [effects]);
  return (
    <Dialog
      title={title}
      onClose={() => (asked.value = null)}
      actions={
        <>
          <button type="button" class="secondary" onClick={() => (asked.value = null)}>
            {text.cancel}
          </button>
          <button
            ref={confirm}
            type="button"
            class="primary"
            disabled={!effects || effects.every(({ problem }) => problem)}
            onClick={() => void send(order, takes)}
          >
            {label}
          </button>
        </>
      }
    >
      {!effects && <p role="status">{text.looking}</p>}
      {effects && (
        <ul class="fleet-effects" aria-label={text.effects} tabIndex={0}>
          {effects.map((effect) => (
            <li key={effect.resource}>
              <strong>{effect.resource}</strong>
              <EffectText effect={effect} takes={verb === "hold" || verb === "execute"} />
            </li>
          ))}
        </ul>
      )}
    </Dialog>
  );
}

function EffectText({ effect, takes }: { effect: Effect; takes: boolean }) {
  const { problem, says, take } = effect;
  if (problem) return <span class="bad">{fill(text.refused, { problem })}</span>;
  if (says.length === 0 && !take) return takes ? <small>{text.nothingEnds}</small> : null;
  return (
    <>
      {take && takes && <span>{text.willBeTaken}</span>}
      {says.map((line) => (
        <span key={line} class="warn">
          {line}
        </span>
      ))}
    </>
  );
}
