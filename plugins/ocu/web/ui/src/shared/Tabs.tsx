// Panes of which one is seen at a time. Arrow keys go from tab to tab.
import type { ComponentChildren } from "preact";
import { useSignal, type Signal } from "@preact/signals";
import { useUniqueId } from "./uniqueId";
import "./tabs.css";

export interface Tab {
  id: string;
  title: ComponentChildren;
  render: () => ComponentChildren;
}

export interface TabsProps {
  label: string;
  tabs: Tab[];
  /** The id of the one that is seen, where others choose it, too. */
  chosen?: Signal<string>;
}

export function Tabs({ label, tabs, chosen }: TabsProps) {
  const own = useSignal(tabs[0]!.id);
  const shown = chosen ?? own;
  const prefix = useUniqueId();
  const current = tabs.find(({ id }) => id === shown.value) ?? tabs[0]!;
  return (
    <div class="tabs">
      <TabList
        label={label}
        tabs={tabs}
        chosen={current.id}
        panel={`${prefix}-panel`}
        onChoose={(id) => (shown.value = id)}
      />
      <div id={`${prefix}-panel`} class="tab-panel" role="tabpanel" aria-label={current.id}>
        {current.render()}
      </div>
    </div>
  );
}

export interface TabListProps {
  label: string;
  tabs: readonly { id: string; title: ComponentChildren }[];
  chosen: string;
  /** The id of what the tabs show. */
  panel: string;
  onChoose: (id: string) => void;
}

export function TabList({ label, tabs, chosen, panel, onChoose }: TabListProps) {
  const key = (event: KeyboardEvent & { currentTarget: HTMLElement }) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by === undefined) return;
    event.preventDefault();
    const at = tabs.findIndex(({ id }) => id === chosen);
    const next = tabs[(at + by + tabs.length) % tabs.length]!;
    onChoose(next.id);
    const buttons = event.currentTarget.querySelectorAll<HTMLElement>("[role=tab]");
    buttons[tabs.indexOf(next)]?.focus();
  };
  return (
    <div class="tab-list" role="tablist" aria-label={label} onKeyDown={key}>
      {tabs.map(({ id, title }) => (
        <button
          key={id}
          type="button"
          role="tab"
          aria-selected={id === chosen}
          aria-controls={panel}
          tabIndex={id === chosen ? 0 : -1}
          onClick={() => onChoose(id)}
        >
          {title}
        </button>
      ))}
    </div>
  );
}
