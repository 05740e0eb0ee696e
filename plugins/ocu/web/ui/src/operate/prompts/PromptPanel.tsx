// Questions to the operators: above all else on the page until they are answered.
import { useComputed, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { Countdown } from "../../alerts/Countdown";
import { command } from "../../shared/command";
import { listen } from "../../shared/executive";
import { go } from "../../shared/router";
import { may, session } from "../../shared/session";
import { toast } from "../../shared/Toasts";
import type { Prompt } from "../../shared/types";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";
import { isTyping } from "../layout/keys";
import "./prompts.css";

const text = strings.operate.prompts;

/** A key or click of just now may have been meant for what was there before. */
const DEAF_MS = 700;

export function PromptPanel() {
  const { scene, mission, selected } = useOperating();
  const panel = useRef<HTMLElement>(null);
  const chosen = useSignal("");
  const sending = useSignal("");
  const ready = useSignal(false);
  // Questions of this run come first; within a run, the oldest.
  const queue = useComputed(() => {
    const own = (prompt: Prompt) => Number(prompt.run !== scene.run);
    return [...scene.prompts.value].sort((one, other) => own(one) - own(other));
  });
  const prompts = queue.value;
  const at = Math.max(
    0,
    prompts.findIndex((prompt) => idOf(prompt) === chosen.value),
  );
  const prompt = prompts[at];
  const id = prompt ? idOf(prompt) : "";
  const mayAnswer = may("operator");
  const usable = mayAnswer && ready.value && sending.value !== id;

  useTellWhoWasFirst();

  useEffect(() => {
    if (!id) return;
    ready.value = false;
    const deaf = setTimeout(() => (ready.value = true), DEAF_MS);
    const before = document.activeElement;
    if (!isTyping(before)) panel.current?.focus({ preventScroll: true });
    return () => {
      clearTimeout(deaf);
      const lost = document.activeElement === document.body;
      if (lost && before instanceof HTMLElement && before.isConnected) before.focus();
    };
  }, [id]);

  const answer = async (decision: string) => {
    if (!prompt || !usable) return;
    sending.value = id;
    const path = `/runs/${encodeURIComponent(prompt.run)}/prompts/${encodeURIComponent(prompt.prompt)}`;
    const done = await command(path, { decision });
    if (!done) sending.value = "";
  };

  useEffect(() => {
    if (!prompt || !mayAnswer) return;
    const press = (event: KeyboardEvent) => {
      if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
      if (isTyping(document.activeElement) || document.getElementById("main")?.inert) return;
      const decision = prompt.decisions[Number(event.key) - 1];
      if (/^[1-9]$/.test(event.key) && decision) {
        event.preventDefault();
        void answer(decision.value);
      }
    };
    addEventListener("keydown", press);
    return () => removeEventListener("keydown", press);
  });

  if (!prompt) return null;
  const title =
    prompts.length > 1 ? fill(text.titleOf, { number: at + 1, count: prompts.length }) : text.title;
  return (
    <section
      ref={panel}
      class="prompt"
      role="alertdialog"
      aria-label={title}
      aria-describedby="prompt-text"
      tabIndex={-1}
    >
      <div class="prompt-about">
        <strong>{title}</strong>
        <button
          type="button"
          class="prompt-where"
          title={text.show}
          onClick={() => {
            const { run, process, element } = prompt;
            if (run === scene.run) selected.value = { process, element, show: true };
            else go(`/runs/${encodeURIComponent(run)}`);
          }}
        >
          {prompt.run === scene.run
            ? fill(text.of, { element: mission.label(prompt.process, prompt.element) })
            : fill(text.run, { run: prompt.run })}
        </button>
        <Countdown run={prompt.run} prompt={prompt.prompt} />
        {prompt.role && <span>{fill(text.role, { role: prompt.role })}</span>}
      </div>
      <p id="prompt-text">{prompt.text || mission.label(prompt.process, prompt.element)}</p>
      <div class="prompt-decisions">
        {mayAnswer ? (
          prompt.decisions.map(({ value, label }, index) => (
            <button
              key={value}
              type="button"
              disabled={!usable}
              title={text.keys}
              aria-keyshortcuts={index < 9 ? String(index + 1) : undefined}
              onClick={() => void answer(value)}
            >
              {index < 9 && <kbd aria-hidden="true">{index + 1}</kbd>}
              {label || value}
            </button>
          ))
        ) : (
          <span>{fill(text.viewer, { decisions: decisionsOf(prompt) })}</span>
        )}
        {prompts.length > 1 && (
          <button
            type="button"
            class="prompt-next"
            onClick={() => (chosen.value = idOf(prompts[(at + 1) % prompts.length]!))}
          >
            {text.next}
          </button>
        )}
        {sending.value === id && <span role="status">{text.sent}</span>}
      </div>
    </section>
  );
}

const decisionsOf = ({ decisions }: Prompt): string =>
  decisions.map(({ value, label }) => `“${label || value}”`).join(", ");

const idOf = ({ run, prompt }: Prompt): string => `${run}/${prompt}`;

/** Shows an operator who was about to answer that another one was first. */
function useTellWhoWasFirst(): void {
  const { scene } = useOperating();
  const standing = useRef<Prompt[]>([]);
  // While listeners are called, this is still the list of before it.
  useEffect(() => scene.prompts.subscribe((now) => void (standing.current = now)), [scene]);
  useEffect(() => {
    return listen((message) => {
      if (message.type !== "prompt_closed") return;
      const was = standing.current.find(
        ({ run, prompt }) => run === message.run && prompt === message.prompt,
      );
      if (!was) return;
      if (!message.by) toast(fill(text.withdrawn, { text: was.text }));
      else if (message.by !== session.value?.user) {
        const label = was.decisions.find(({ value }) => value === message.decision)?.label;
        toast(fill(text.answered, { by: message.by, decision: label || message.decision }));
      }
    });
  }, []);
}
