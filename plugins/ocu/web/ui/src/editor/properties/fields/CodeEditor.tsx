// An expression or script: marked as it is read, with what may come next, and words on what is below the pointer.
import { autocompletion, closeCompletion } from "@codemirror/autocomplete";
import type { Completion } from "@codemirror/autocomplete";
import { history, historyKeymap, standardKeymap } from "@codemirror/commands";
import { Compartment, EditorState, Prec, StateEffect, StateField } from "@codemirror/state";
import { Decoration, EditorView, hoverTooltip, keymap } from "@codemirror/view";
import type { DecorationSet } from "@codemirror/view";
import { useEffect, useRef } from "preact/hooks";
import type { Token } from "../../condition/dialect";
import type { CodeFieldProps } from "./CodeField";
import { described, Field } from "./Field";
import { useDraft } from "./useDraft";
import "./code.css";

const THEME = EditorView.theme({
  "&": { color: "inherit", fontSize: "inherit" },
  "&.cm-focused": { outline: "none" },
  ".cm-scroller": { fontFamily: "inherit", lineHeight: "1.4" },
  ".cm-content": { padding: "0", caretColor: "var(--ink)" },
  ".cm-line": { padding: "0" },
  ".cm-tooltip": {
    color: "var(--ink)",
    background: "var(--paper)",
    border: "1px solid var(--rule)",
    borderRadius: "var(--radius)",
  },
  ".cm-tooltip.cm-tooltip-autocomplete > ul": { maxHeight: "20em", fontFamily: "inherit" },
  ".cm-tooltip.cm-tooltip-autocomplete > ul > li[aria-selected]": {
    color: "var(--ink)",
    background: "var(--paper-sunken)",
  },
  ".cm-completionDetail": { color: "var(--ink-faint)", fontStyle: "normal" },
});
const problems = StateEffect.define<readonly number[]>();
const problem = Decoration.mark({ class: "m2-code-wrong" });
const problemMarks = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(marks, transaction) {
    const set = transaction.effects.find((each) => each.is(problems));
    if (!set) return marks.map(transaction.changes);
    const { length } = transaction.newDoc;
    // At the end, the last character is marked: there is no other.
    const starts = (set.value as number[]).map((at) => Math.max(0, Math.min(at, length - 1)));
    const found = [...new Set(starts)].sort((a, b) => a - b);
    return Decoration.set(length ? found.map((at) => problem.range(at, at + 1)) : []);
  },
  provide: (field) => EditorView.decorations.from(field),
});

export default function CodeEditor(props: CodeFieldProps) {
  const { id, hint, error, required } = props;
  const host = useRef<HTMLDivElement>(null);
  const editor = useRef<EditorView | null>(null);
  const attributes = useRef(new Compartment());
  const draft = useDraft(props.value, props.write);
  const now = useRef({ props, draft });
  now.current = { props, draft };
  const referring = EditorView.contentAttributes.of(attributesOf(props));

  useEffect(() => {
    editor.current = new EditorView({
      parent: host.current!,
      state: EditorState.create({
        doc: draft.value,
        extensions: [
          history(),
          completing((typed, cursor) => now.current.props.suggest(typed, cursor)),
          explaining((typed, at) => explained(now.current.props, typed, at)),
          // A formula of one line has no other: Enter only chooses.
          props.isOneLine ? keymap.of([{ key: "Enter", run: () => true }]) : [],
          keymap.of([...historyKeymap, ...standardKeymap]),
          EditorView.lineWrapping,
          EditorView.decorations.compute(["doc"], (state) =>
            marked(now.current.props.tokens?.(state.doc.toString()) ?? []),
          ),
          problemMarks,
          THEME,
          EditorState.phrases.of({ Completions: props.offered }),
          attributes.current.of(referring),
          EditorView.updateListener.of((update) => {
            const typed = update.state.doc.toString();
            if (update.docChanged && typed !== now.current.draft.value) now.current.draft.type(typed);
          }),
          EditorView.domEventHandlers({ blur: () => now.current.draft.commit() }),
        ],
      }),
    });
    return () => editor.current?.destroy();
  }, []);
  useEffect(() => {
    const view = editor.current!;
    const { doc } = view.state;
    // What is being typed is ahead of what has been drawn.
    if (view.hasFocus || doc.toString() === draft.value) return;
    view.dispatch({ changes: { from: 0, to: doc.length, insert: draft.value } });
  });
  useEffect(() => {
    editor.current!.dispatch({ effects: attributes.current.reconfigure(referring) });
  }, [id, error, hint, required]);
  const places = props.wrongAt.join();
  useEffect(() => {
    editor.current!.dispatch({ effects: problems.of(props.wrongAt) });
  }, [places]);

  return (
    <Field id={id} label={props.label} required={required ?? false} hint={hint} error={error}>
      <div
        ref={host}
        class="m2-input m2-mono m2-code"
        style={{ "--rows": props.rows }}
        onMouseDown={({ target, currentTarget }) => {
          // Below the last line, too, the text gets the focus.
          if (target === currentTarget) requestAnimationFrame(() => editor.current?.focus());
        }}
      />
      {props.below?.(draft.value)}
    </Field>
  );
}

function attributesOf({ id, error, hint, required }: CodeFieldProps): Record<string, string> {
  const all = {
    id,
    "aria-labelledby": `${id}-label`,
    "aria-required": required ? "true" : "",
    spellcheck: "false",
    ...described(id, error, hint),
  };
  const found = Object.entries(all).filter((each): each is [string, string] => !!each[1]);
  return Object.fromEntries(found);
}

function completing(suggest: CodeFieldProps["suggest"]) {
  const sections = new Map<string, { name: string; rank: number }>();
  const sectionOf = (name: string) => {
    if (!sections.has(name)) sections.set(name, { name, rank: sections.size });
    return sections.get(name)!;
  };
  return [
    autocompletion({
      icons: false,
      // Enter ends the line unless something has been chosen, and what is chosen at once counts.
      selectOnOpen: false,
      interactionDelay: 0,
      activateOnTypingDelay: 0,
      override: [
        async ({ state, pos }) => {
          const { from, options } = await suggest(state.doc.toString(), pos);
          if (options.length === 0) return null;
          const shown = options.map(
            ({ value, note, doc, group }): Completion => ({
              label: value,
              ...(note ? { detail: note } : {}),
              ...(doc ? { info: doc } : {}),
              ...(group ? { section: sectionOf(group) } : {}),
            }),
          );
          return { from, options: shown, filter: false };
        },
      ],
    }),
    Prec.highest(
      keymap.of([
        // The list closes, and nothing around it.
        { key: "Escape", run: closeCompletion, stopPropagation: true },
      ]),
    ),
  ];
}

function explained(props: CodeFieldProps, typed: string, at: number) {
  const token = props.tokens?.(typed).find(({ from, to }) => from <= at && at < to);
  const lines = token ? (props.explain?.(typed, token) ?? []) : [];
  return token && lines.length > 0 ? { ...token, lines } : null;
}

function explaining(explain: (typed: string, at: number) => (Token & { lines: string[] }) | null) {
  return hoverTooltip(({ state }, at) => {
    const found = explain(state.doc.toString(), at);
    if (!found) return null;
    const { from, to, lines } = found;
    return {
      pos: from,
      end: to,
      create: () => {
        const dom = document.createElement("div");
        dom.className = "m2-code-said";
        dom.setAttribute("role", "tooltip");
        dom.append(...lines.map((line) => Object.assign(document.createElement("p"), { textContent: line })));
        return { dom };
      },
    };
  });
}

function marked(tokens: readonly Token[]): DecorationSet {
  return Decoration.set(
    tokens.map(({ kind, from, to }) => Decoration.mark({ class: `m2-code-${kind}` }).range(from, to)),
  );
}
