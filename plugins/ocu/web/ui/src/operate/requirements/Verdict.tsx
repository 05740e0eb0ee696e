// One requirement, and what is certain of it.
import type { ComponentChildren } from "preact";
import { OVER } from "../../shared/executive";
import { clockTenths } from "../../shared/format";
import type { Requirement, RunStatus } from "../../shared/types";
import { fill, strings } from "../../strings";
import "./requirements.css";

const text = strings.monitors;

const SIGNS = { violated: "✕", satisfied: "✓", open: "○" };

export interface VerdictProps {
  name: string;
  requirement: Requirement;
  /** Of the run: one that is over decides nothing more. */
  status: RunStatus | null;
  /** What the name does when it is chosen; left out: nothing. */
  onShow?: (() => void) | undefined;
  hint?: string;
  /** Its elements. */
  children?: ComponentChildren;
}

export function Verdict({ name, requirement, status, onShow, hint, children }: VerdictProps) {
  const { verdict, since, english, because, formula, on_violation } = requirement;
  const head = (
    <>
      <i class={`verdict-sign verdict-${verdict}`} aria-hidden="true">
        {SIGNS[verdict]}
      </i>
      <strong>{name}</strong>{" "}
      <span>
        {text.states[verdict]}
        {since !== null && ` ${fill(text.since, { time: clockTenths(since) })}`}
      </span>
    </>
  );
  const [kind = "", ...rest] = on_violation.split(":");
  const thrown = kind === "error" || kind === "signal" ? text.throws[kind] : "";
  return (
    <li class={`verdict verdict-of-${verdict}`}>
      {onShow ? (
        <button type="button" class="plain verdict-head" title={hint} onClick={onShow}>
          {head}
        </button>
      ) : (
        <p class="verdict-head">{head}</p>
      )}
      <p>{english}</p>
      {verdict === "open" && (
        <p class="hint">{status && OVER.has(status) ? text.neverDecided : text.openHint}</p>
      )}
      {because && <p>{fill(verdict === "open" ? text.openBecause : text.because, { because })}</p>}
      {thrown && <p class="hint">{fill(thrown, { name: rest.join(":") })}</p>}
      {children}
      <details>
        <summary>{text.formula}</summary>
        <code>{formula}</code>
      </details>
    </li>
  );
}
