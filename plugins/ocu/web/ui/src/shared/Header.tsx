// On every page: which fleet, who looks, whether what moves is real, and how to stop it.
import { effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { ControlRequests } from "../people/ControlRequests";
import { Present } from "../people/Present";
import { fill, strings } from "../strings";
import { AlertBell } from "../alerts/AlertBell";
import { calling } from "../alerts/alerts";
import { connect, connection, prompts } from "./executive";
import { loaded } from "./loaded";
import { go, route } from "./router";
import { may, session, signOut } from "./session";
import { standbys } from "./standbys";
import { StopAlert } from "./StopAlert";
import { StopButton } from "./StopButton";
import { ALL, stop } from "./stopping";
import "./settings";
import "./theme";
import { attempt } from "./Toasts";
import "./header.css";

const SettingsDialog = loaded(() => import("../settings/SettingsDialog"));

const text = strings.shell;

const isSetting = signal(false);

// Questions and other alerts are seen from another tab of the browser as well.
effect(() => {
  const count = prompts.value.length;
  const more = calling.value.filter(({ code }) => code !== "QUESTION").length;
  const fleet = session.value?.fleet;
  document.title = [
    count > 0 ? `(${count}?)` : "",
    more > 0 ? `(${more}!)` : "",
    text.title,
    fleet ? `– ${fleet}` : "",
  ]
    .filter(Boolean)
    .join(" ");
});

export function Header() {
  const who = session.value;
  const top = useRef<HTMLDivElement>(null);
  useEffect(() => followHeight(top.current!), []);
  return (
    <div id="top" ref={top}>
      <a class="skip" href="#main">
        {text.skip}
      </a>
      <header class="header">
        <div class="header-rest">
          <a class="brand" href="/" onClick={leave("/")}>
            <svg viewBox="0 0 24 24" width="22" height="22" aria-hidden="true">
              <path d="M4 12h5m6 0h5" stroke="currentColor" stroke-width="2" fill="none" />
              <path d="M9 12 12 8l3 4-3 4z" fill="currentColor" />
              <circle cx="4" cy="12" r="2.6" fill="currentColor" />
              <circle cx="20" cy="12" r="2.6" fill="currentColor" />
            </svg>
            <span class="brand-name">{text.title}</span>
          </a>
          {who && (
            <>
              <span class="fleet" title={text.fleet}>
                {who.fleet}
              </span>
              <Reality simulated={who.simulated} />
              <Link />
              <nav class="header-pages" aria-label={text.pages}>
                <PageLink to="/" label={text.home} isHere={route.value.page === "home"} />
                <PageLink to="/fleet" label={text.fleetPage} isHere={route.value.page === "fleet"} />
              </nav>
            </>
          )}
          <span class="space" />
          {who && (
            <span class="who" title={text.signedInAs}>
              {who.user} <small>{text.roles[who.role]}</small>
            </span>
          )}
          {who && (
            <button type="button" class="plain" onClick={() => void attempt(signOut)}>
              {text.signOut}
            </button>
          )}
        </div>
        <div class="header-calls">
          {who && <Questions />}
          {who && <AlertBell />}
          {who && <Present />}
          <button
            type="button"
            class="plain"
            aria-haspopup="dialog"
            aria-label={text.settings}
            title={text.settings}
            onClick={() => (isSetting.value = true)}
          >
            <svg viewBox="0 0 24 24" width="20" height="20" aria-hidden="true">
              <circle cx="12" cy="12" r="6" fill="none" stroke="currentColor" stroke-width="3" />
              <path
                d="M12 2v4m0 12v4M2 12h4m12 0h4M5 5l2.8 2.8m8.4 8.4L19 19M19 5l-2.8 2.8m-8.4 8.4L5 19"
                stroke="currentColor"
                stroke-width="2.6"
              />
            </svg>
          </button>
        </div>
        {may("operator") && (
          <StopButton
            class="stop-all"
            label={text.stop}
            again={text.stopAgain}
            hint={text.stopHint}
            hotkey
            onStop={() => void stop(ALL, text.stopAllRuns)}
          />
        )}
      </header>
      {isSetting.value && (
        <SettingsDialog onClose={() => (isSetting.value = false)} />
      )}
      {who && <StopAlert />}
      {who && <ControlRequests />}
      {who && connection.value === "lost" && (
        <div class="offline" role="alert">
          {text.offline}
          {standbys.value.map(({ host, pid, page }) => (
            <span key={page}>
              {" "}
              {text.standby} <a href={page}>{named(pid, host)}</a>
            </span>
          ))}
          <button type="button" onClick={connect}>
            {text.retry}
          </button>
        </div>
      )}
    </div>
  );
}

/** Dialogs and panels begin below all that is said above the page: `--top` is where. */
function followHeight(top: HTMLElement): () => void {
  const observer = new ResizeObserver(() => {
    document.documentElement.style.setProperty("--top", `${top.offsetHeight}px`);
  });
  observer.observe(top);
  return () => observer.disconnect();
}

function PageLink({ to, label, isHere }: { to: string; label: string; isHere: boolean }) {
  return (
    <a href={to} aria-current={isHere ? "page" : undefined} onClick={leave(to)}>
      {label}
    </a>
  );
}

function Reality({ simulated }: { simulated: boolean }) {
  return simulated ? (
    <span class="reality" title={text.simulatedHint}>
      {text.simulated}
    </span>
  ) : (
    <strong class="reality reality-real" title={text.realHint}>
      {text.real}
    </strong>
  );
}

const named = (pid: number, host: string) => fill(text.process, { pid: String(pid), host });

function Link() {
  const state = connection.value;
  const said = { open: text.connected, connecting: text.connecting }[state as "open"];
  const names = standbys.value.map(({ pid, host }) => named(pid, host)).join(", ");
  const standby = names ? `${text.standby} ${names}` : text.noStandby;
  return (
    <span class={`link link-${state}`} title={`${said ?? text.offline} ${standby}`}>
      <i aria-hidden="true" />
      <span class={said ? "for-readers" : ""}>{said ?? text.offlineShort}</span>
    </span>
  );
}

/** Questions of runs, wherever one is in the page. */
function Questions() {
  const standing = prompts.value;
  const first = standing[0];
  const at = route.value;
  if (!first || (at.page === "run" && at.run === first.run)) return null;
  const path = `/runs/${encodeURIComponent(first.run)}`;
  return (
    <a class="questions" href={path} onClick={leave(path)}>
      {standing.length}
      <span class="questions-words">
        {" "}
        {standing.length === 1 ? text.question : text.questions}
      </span>
      <span class="questions-mark" aria-hidden="true">
        {" "}
        ?
      </span>
    </a>
  );
}

function leave(path: string) {
  return (event: MouseEvent) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey || event.button !== 0) return;
    event.preventDefault();
    go(path);
  };
}
