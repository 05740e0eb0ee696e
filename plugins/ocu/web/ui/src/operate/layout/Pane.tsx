// One part of the page, with its name and its own buttons.
import type { ComponentChildren } from "preact";
import { useUniqueId } from "../../shared/uniqueId";

export interface PaneProps {
  title: string;
  tools?: ComponentChildren;
  children: ComponentChildren;
  class?: string;
  /** What is in it may be longer than it: the keyboard scrolls it. */
  scrolls?: boolean;
}

export function Pane({ title, tools, children, class: more = "", scrolls = false }: PaneProps) {
  const id = useUniqueId();
  return (
    <section class={`pane ${more}`} aria-labelledby={id}>
      <header>
        <h2 id={id}>{title}</h2>
        {tools}
      </header>
      {scrolls ? (
        <div class="pane-body" role="group" aria-labelledby={id} tabIndex={0}>
          {children}
        </div>
      ) : (
        <div class="pane-body">{children}</div>
      )}
    </section>
  );
}
