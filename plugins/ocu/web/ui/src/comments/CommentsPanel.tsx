// The tab of comments: what persons say about the selected element, and about all others.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { EditorContext, Panel } from "../editor/panels/panel";
import { showPanel } from "../editor/panels/shown";
import { isSelf } from "../people/people";
import { moment } from "../shared/moments";
import { may } from "../shared/session";
import { counted, fill, strings } from "../strings";
import { comments, drop, followComments, resolve, write } from "./comments";
import { openByElement, threadsOf, type MissionComment, type Thread } from "./threads";
import "./comments.css";

const words = strings.comments;
const LONGEST = 2000;
const LAYER = "m2-comments";
const PANEL = "comments";

export const commentsPanel: Panel = {
  id: PANEL,
  title: words.title,
  badge: () => comments.value.filter((each) => !each.parent && !each.resolved_by).length,
  render: (editor) => <Comments editor={editor} />,
};

function Comments({ editor }: { editor: EditorContext }) {
  const { mission } = editor;
  useEffect(() => followComments(mission), [mission]);
  const open = openByElement(comments.value);
  const [only, ...more] = editor.selected.value;
  const about = only && more.length === 0 ? (only.businessObject as { id?: string }) : undefined;
  const element = about?.id ?? "";
  useEffect(() => mark(editor, open), [editor.changes.value, comments.value]);
  const nameOf = (id: string): string | undefined => {
    const drawn = editor.service("elementRegistry").get(id);
    return drawn && (String((drawn.businessObject?.name as unknown) ?? "") || id);
  };
  const label = element && (nameOf(element) ?? element);
  const threads = threadsOf(comments.value, element);
  return (
    <div class="comments">
      {may("operator") ? (
        <Writing
          label={element ? fill(words.ofElement, { element: label }) : words.ofMission}
          act={words.add}
          send={(text) => write(mission, { text, element, label })}
        />
      ) : (
        <p class="m2-note">{words.viewer}</p>
      )}
      <p class="m2-field-hint">{words.hint}</p>
      {threads.length === 0 && <p>{words.none}</p>}
      <ol>
        {threads.map((thread) => (
          <li key={thread.first.id} class={thread.first.resolved_by ? "comment-resolved" : ""}>
            <Threaded
              mission={mission}
              thread={thread}
              name={thread.first.element ? nameOf(thread.first.element) : words.whole}
              show={() => void editor.select(thread.first.element)}
            />
          </li>
        ))}
      </ol>
    </div>
  );
}

interface ThreadedProps {
  mission: string;
  thread: Thread;
  /** undefined: this version has no such element. */
  name: string | undefined;
  show(): void;
}

function Threaded({ mission, thread: { first, answers }, name, show }: ThreadedProps) {
  const isAnswering = useSignal(false);
  const isResolved = first.resolved_by !== "";
  return (
    <article>
      {first.element && name !== undefined ? (
        <button
          type="button"
          class="plain comment-about"
          aria-label={fill(words.show, { element: name })}
          onClick={show}
        >
          {name}
        </button>
      ) : (
        <b>{name ?? fill(words.gone, { label: first.label || first.element })}</b>
      )}
      {isResolved && <small> {fill(words.resolved, { by: first.resolved_by })}</small>}
      {[first, ...answers].map((each) => (
        <Said key={each.id} mission={mission} comment={each} />
      ))}
      {may("operator") && (
        <p class="comment-tools">
          <button
            type="button"
            class="secondary"
            aria-expanded={isAnswering.value}
            onClick={() => (isAnswering.value = !isAnswering.value)}
          >
            {words.answer}
          </button>
          <button
            type="button"
            class="secondary"
            onClick={() => void resolve(mission, first.id, !isResolved)}
          >
            {isResolved ? words.reopen : words.resolve}
          </button>
        </p>
      )}
      {isAnswering.value && (
        <Writing
          label={fill(words.answerTo, { by: first.by })}
          act={words.send}
          send={async (text) => {
            const isSent = await write(mission, { text, parent: first.id });
            if (isSent) isAnswering.value = false;
            return isSent;
          }}
        />
      )}
    </article>
  );
}

function Said({ mission, comment }: { mission: string; comment: MissionComment }) {
  const { by, at_us, text, id } = comment;
  return (
    <div class={comment.parent ? "comment comment-answer" : "comment"}>
      <small>{fill(words.said, { by, at: moment(at_us / 1000) })}</small>
      <p>{text}</p>
      {((may("operator") && isSelf(by)) || may("commander")) && (
        <button
          type="button"
          class="plain"
          aria-label={`${words.remove}: ${text.slice(0, 40)}`}
          onClick={() => void drop(mission, id)}
        >
          {words.remove}
        </button>
      )}
    </div>
  );
}

interface WritingProps {
  label: string;
  act: string;
  send(text: string): Promise<boolean>;
}

function Writing({ label, act, send }: WritingProps) {
  const text = useSignal("");
  const busy = useSignal(false);
  const submit = async () => {
    busy.value = true;
    if (await send(text.value.trim())) text.value = "";
    busy.value = false;
  };
  return (
    <form
      class="comment-form"
      onSubmit={(event) => {
        event.preventDefault();
        if (text.value.trim() && !busy.value) void submit();
      }}
    >
      <label>
        {label}
        <textarea
          rows={2}
          maxLength={LONGEST}
          value={text.value}
          onInput={(event) => (text.value = event.currentTarget.value)}
        />
      </label>
      <button type="submit" class="secondary" disabled={busy.value || !text.value.trim()}>
        {act}
      </button>
    </form>
  );
}

/** A badge on each element with open comments: a click shows them. */
function mark(editor: EditorContext, open: ReadonlyMap<string, number>): void {
  const overlays = editor.service("overlays");
  overlays.remove({ type: LAYER });
  const registry = editor.service("elementRegistry");
  for (const [id, count] of open) {
    const element = registry.get(id);
    if (!element?.parent) continue;
    const made = document.createElement("button");
    made.type = "button";
    made.className = "comment-badge";
    made.textContent = String(count);
    const name = String((element.businessObject?.name as unknown) ?? "") || id;
    made.setAttribute("aria-label", counted(words.badge, count, { element: name }));
    made.addEventListener("click", () => {
      void editor.select(id);
      showPanel(PANEL);
    });
    overlays.add(id, LAYER, { position: { bottom: 8, right: 10 }, html: made });
  }
}
