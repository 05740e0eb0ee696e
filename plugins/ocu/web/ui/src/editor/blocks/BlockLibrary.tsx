// The blocks beside the canvas: dragged to their place, or put behind what is selected.
import { useMemo, useState } from "preact/hooks";
import { strings } from "../../strings";
import type { EditorSession } from "../session/EditorSession";
import type { Element } from "../session/services";
import { blocksOf, GROUPS, matching, type Block } from "./blocks";
import { iconSvg } from "./icons";
import { draggingOf, makeShape } from "./making";
import { takesPlace, type Tools } from "./putting";

const words = strings.editor.blocks;

export function BlockLibrary({ session }: { session: EditorSession }) {
  const [search, setSearch] = useState("");
  const blocks = useMemo(() => blocksOf(session.catalogue), [session]);
  const found = matching(session.catalogue, blocks, search);
  return (
    <section class="m2-blocks" aria-label={words.title}>
      <input
        type="search"
        class="m2-blocks-search"
        placeholder={words.search}
        aria-label={words.search}
        value={search}
        onInput={(event) => setSearch(event.currentTarget.value)}
      />
      <p id="m2-blocks-hint" class="m2-hidden">
        {words.hint}
      </p>
      {found.length === 0 && <p class="m2-note">{words.none}</p>}
      {GROUPS.map((group) => {
        const inside = found.filter((block) => block.group === group);
        return (
          inside.length > 0 && (
            <details key={group} open>
              <summary>{words.groups[group]}</summary>
              <ul>
                {inside.map((block) => (
                  <li key={block.id}>
                    <BlockButton session={session} block={block} />
                  </li>
                ))}
              </ul>
            </details>
          )
        );
      })}
    </section>
  );
}

function BlockButton({ session, block }: { session: EditorSession; block: Block }) {
  const shape = () =>
    makeShape(
      session.service("edits").factory,
      session.service("elementFactory"),
      session.catalogue,
      block,
    );
  const drag = (event: Event) =>
    session.service("create").start(event, shape(), draggingOf(block));
  const click = (event: MouseEvent) => {
    const [selected, ...more] = session.selected.value;
    const isAimed = selected && !more.length && mayFollow(session, selected);
    // What is open, and what has a course that goes on, says where the block goes.
    if (isAimed && takesPlace(toolsOf(session), selected, block)) return;
    // A mouse carries the block to its place; a keyboard or a finger cannot.
    const isMouse = event.detail > 0 && (event as PointerEvent).pointerType !== "touch";
    if (isMouse) drag(event);
    else place(session, block, shape);
  };
  return (
    <button
      type="button"
      class="m2-block"
      draggable
      title={[block.doc, block.word].filter(Boolean).join("\n")}
      aria-describedby="m2-blocks-hint"
      onClick={click}
      onDragStart={(event) => {
        event.preventDefault();
        drag(event);
      }}
    >
      <span dangerouslySetInnerHTML={{ __html: iconSvg(block.group, 22) }} />
      {block.title}
    </button>
  );
}

function toolsOf(session: EditorSession): Tools {
  return {
    catalogue: session.catalogue,
    edits: session.service("edits"),
    fragments: session.service("fragments"),
  };
}

function mayFollow(session: EditorSession, element: Element): boolean {
  return Boolean(session.service("rules").allowed("shape.append", { element }));
}

/** Behind what is selected, or else in the middle of what is seen. */
function place(session: EditorSession, { content }: Block, shape: () => Element): void {
  const [selected, ...more] = session.selected.value;
  if (selected && !more.length && mayFollow(session, selected)) {
    session.service("autoPlace").append(selected, shape());
    return;
  }
  const canvas = session.service("canvas");
  const { x, y, width, height } = canvas.viewbox();
  const at = { x: Math.round(x + width / 2), y: Math.round(y + height / 2) };
  const parent = poolAt(session, at) ?? canvas.getRootElement();
  if (content.kind === "fragment") {
    session.service("fragments").putAt(content.fragment, at, parent as Element);
    return;
  }
  const made = session.service("modeling").createShape(shape() as never, at, parent as never);
  session.service("selection").select(made as never);
}

interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

function poolAt(session: EditorSession, { x, y }: { x: number; y: number }) {
  const pools = session
    .service("elementRegistry")
    .filter((each) => each.type === "bpmn:Participant") as unknown as Box[];
  const isInside = (box: Box) =>
    x > box.x && x < box.x + box.width && y > box.y && y < box.y + box.height;
  return pools.find(isInside) ?? pools[0];
}
