// Tabs beside the canvas. Panels stay mounted, so that nothing that was typed or found is lost.
import { useEffect, useRef, useState } from "preact/hooks";
import { remember, remembered } from "../../shared/memory";
import { strings } from "../../strings";
import type { EditorContext, Panel } from "./panel";
import { panels } from "./panels";
import { FIRST_PANEL, showPanel, shownPanel } from "./shown";
import { textScale } from "../../shared/textScale";

const words = strings.editor.panel;
/** In px at the usual text size. */
const LEAST = 240;
const MOST = 720;
const USUAL = 380;
const STEP = 24;

export function SidePanel({ editor }: { editor: EditorContext }) {
  const shown = shownPanel.value;
  useEffect(() => showPanel(FIRST_PANEL), [editor]);
  const [width, setWidth] = useState(() => remembered("editor-panel-width", USUAL));
  const resize = (next: number) => {
    const bounded = Math.min(MOST, Math.max(LEAST, next));
    setWidth(bounded);
    remember("editor-panel-width", bounded);
  };
  const focus = (at: number) => {
    const next = panels[at];
    if (!next) return;
    showPanel(next.id);
    document.getElementById(`m2-panel-tab-${next.id}`)?.focus();
  };
  return (
    <aside class="m2-side" style={{ width: `${width / 16}rem` }} aria-label={strings.editor.panels.label}>
      <Grip width={width} resize={resize} />
      <div role="tablist" aria-label={strings.editor.panels.label} class="m2-tablist">
        {panels.map((panel, index) => (
          <PanelTab
            key={panel.id}
            editor={editor}
            panel={panel}
            isShown={panel.id === shown}
            show={() => showPanel(panel.id)}
            step={(offset) => focus((index + offset + panels.length) % panels.length)}
            focus={(at) => focus(at < 0 ? panels.length + at : at)}
          />
        ))}
      </div>
      {panels.map((panel) => (
        <div
          key={panel.id}
          id={`m2-panel-${panel.id}`}
          role="tabpanel"
          aria-labelledby={`m2-panel-tab-${panel.id}`}
          class="m2-panel"
          tabIndex={0}
          hidden={panel.id !== shown}
        >
          {panel.render(editor)}
        </div>
      ))}
    </aside>
  );
}

interface PanelTabProps {
  editor: EditorContext;
  panel: Panel;
  isShown: boolean;
  show(): void;
  step(offset: number): void;
  /** The tab at a place; -1: the last one. */
  focus(at: number): void;
}

function PanelTab({ editor, panel, isShown, show, step, focus }: PanelTabProps) {
  const count = panel.badge?.(editor) ?? 0;
  return (
    <button
      id={`m2-panel-tab-${panel.id}`}
      type="button"
      role="tab"
      aria-selected={isShown}
      aria-controls={`m2-panel-${panel.id}`}
      tabIndex={isShown ? 0 : -1}
      onClick={show}
      onKeyDown={(event) => {
        if (event.key === "ArrowRight") step(1);
        if (event.key === "ArrowLeft") step(-1);
        if (event.key === "Home") focus(0);
        if (event.key === "End") focus(-1);
      }}
    >
      {panel.title}
      {count > 0 && <span class="m2-count">{count}</span>}
    </button>
  );
}

function Grip({ width, resize }: { width: number; resize(width: number): void }) {
  const from = useRef<{ x: number; width: number } | null>(null);
  return (
    <div
      class="m2-grip"
      role="separator"
      aria-orientation="vertical"
      aria-label={words.resize}
      aria-valuenow={Math.round(width)}
      aria-valuemin={LEAST}
      aria-valuemax={MOST}
      tabIndex={0}
      onKeyDown={(event) => {
        if (event.key === "ArrowLeft") resize(width + STEP);
        if (event.key === "ArrowRight") resize(width - STEP);
      }}
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        from.current = { x: event.clientX, width };
      }}
      onPointerMove={(event) => {
        if (from.current) {
          resize(from.current.width + (from.current.x - event.clientX) / textScale.value);
        };
      }}
      onPointerUp={() => (from.current = null)}
    />
  );
}
