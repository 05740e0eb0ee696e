// One part of the page, with its name and its own buttons.
import type { ComponentChildren } from "preact";
import { useId } from "preact/hooks";

export interface PaneProps {
  title: string;
  tools?: ComponentChildren;
  children: ComponentChildren;
  class?: string;
}

export function Pane({ title, tools, children, class: more = "" }: PaneProps) {
  const id = useId();
  return (
    <section class={`pane ${more}`} aria-labelledby={id}>
      <header>
        <h2 id={id}>{title}</h2>
        {tools}
      </header>
      <div class="pane-body">{children}</div>
    </section>
  );
}
