// The bell on every page: how many alerts call, and the panel of all that are open.
import { useEffect, useRef, useState } from "preact/hooks";
import { go } from "../shared/router";
import { may } from "../shared/session";
import { counted, fill, strings } from "../strings";
import { Age, AlertActions, AlertText, SeverityMark, Source } from "./AlertLine";
import { acknowledgeAll, alerts, calling, failed, isSevere, nextDeadline_s, span } from "./alerts";
import { EarlierMessages } from "./EarlierMessages";
import { SoundHint } from "./SoundHint";
import "./alerts.css";

const words = strings.alerts;
const SHOWN = 50;

export function AlertBell() {
  const [open, setOpen] = useState(false);
  const button = useRef<HTMLButtonElement>(null);
  const count = calling.value.length;
  const left_s = nextDeadline_s.value;
  const name = count > 0 ? counted(words.bell, count) : words.bellNone;
  const close = () => {
    setOpen(false);
    button.current?.focus();
  };
  return (
    <>
      <button
        ref={button}
        type="button"
        class={["bell", count > 0 && "bell-calls", isSevere.value && "bell-severe"]
          .filter(Boolean)
          .join(" ")}
        aria-expanded={open}
        aria-haspopup="dialog"
        aria-label={name}
        title={name}
        onClick={() => setOpen(!open)}
      >
        <svg viewBox="0 0 24 24" width="20" height="20" aria-hidden="true">
          <path
            d="M12 3a6 6 0 0 0-6 6v4l-2 3.5h16L18 13V9a6 6 0 0 0-6-6zM9.5 18.5a2.5 2.5 0 0 0 5 0z"
            fill="currentColor"
          />
        </svg>
        {count > 0 && <b aria-hidden="true">{count > 99 ? "99+" : count}</b>}
        {left_s !== null && (
          <span class="bell-left" aria-hidden="true">
            {span(left_s)}
          </span>
        )}
      </button>
      <span class="for-readers" role="status">
        {count > 0 ? name : ""}
      </span>
      {open && <AlertPanel close={close} />}
    </>
  );
}

function AlertPanel({ close }: { close: () => void }) {
  const panel = useRef<HTMLDivElement>(null);
  useEffect(() => {
    panel.current?.focus();
    const outside = (event: PointerEvent) => {
      const at = event.target as Element;
      if (!panel.current?.contains(at) && !at.closest(".bell")) close();
    };
    addEventListener("pointerdown", outside);
    return () => removeEventListener("pointerdown", outside);
  }, []);
  useEffect(() => {
    // A button that was pressed is gone when somebody has acknowledged its alert.
    if (document.activeElement === document.body) panel.current?.focus();
  });
  const shown = alerts.value.slice(0, SHOWN);
  return (
    <div
      ref={panel}
      class="alert-panel"
      role="dialog"
      aria-label={words.title}
      tabIndex={-1}
      onKeyDown={(event) => {
        if (event.key !== "Escape" || event.shiftKey) return;
        event.stopPropagation();
        close();
      }}
    >
      <div class="alert-panel-head">
        <h2>{words.title}</h2>
        {may("operator") && calling.value.length > 1 && (
          <button
            type="button"
            class="secondary"
            onClick={() => void acknowledgeAll(calling.value)}
          >
            {fill(words.acknowledgeAll, { count: calling.value.length })}
          </button>
        )}
        <button type="button" class="plain" aria-label={strings.shell.close} onClick={close}>
          ×
        </button>
      </div>
      {failed.value && <p role="alert">{words.failed}</p>}
      {shown.length === 0 && <p class="alert-none">{words.none}</p>}
      <ul class="alert-list">
        {shown.map((alert) => (
          <li key={alert.alert} class={alert.calls ? `alert-calls alert-${alert.severity}` : ""}>
            <div class="alert-about">
              <SeverityMark severity={alert.severity} />
              <span class="alert-source">
                <Source alert={alert} leave={close} />
              </span>
              <span class="alert-age">
                <Age alert={alert} />
              </span>
            </div>
            <div>
              <AlertText alert={alert} />
            </div>
            <div class="alert-do">
              {alert.acknowledged_by && (
                <small>{fill(words.acknowledgedBy, { who: alert.acknowledged_by })}</small>
              )}
              {alert.owner && <small>{fill(words.owner, { who: alert.owner })}</small>}
              <AlertActions alert={alert} />
            </div>
          </li>
        ))}
      </ul>
      <EarlierMessages />
      <SoundHint />
      <a
        class="alert-all"
        href="/alerts"
        onClick={(event) => {
          if (event.ctrlKey || event.metaKey || event.shiftKey || event.button !== 0) return;
          event.preventDefault();
          close();
          go("/alerts");
        }}
      >
        {words.all}
      </a>
    </div>
  );
}
