// Keys of the editor beside those of bpmn-js, which has them while the canvas is focused.
import { list, type ModdleElement } from "../moddle/moddle";
import type { EditorSession } from "./EditorSession";
import type { MissionWork } from "./MissionWork";
import type { Element } from "./services";

const TYPING = "input, textarea, select, [contenteditable='true'], .djs-direct-editing-content";

/** Follows the keys of the page until what it gives is called. */
export function followKeys(work: MissionWork): () => void {
  const pressed = (event: KeyboardEvent) => {
    // The canvas and the properties panel have had it already.
    if (event.defaultPrevented || work.question.peek()) return;
    const isCommand = event.ctrlKey || event.metaKey;
    const isTyping = (event.target as HTMLElement).matches?.(TYPING);
    if (isCommand && event.key.toLowerCase() === "s") {
      event.preventDefault();
      // What is being typed belongs to what is saved.
      (document.activeElement as HTMLElement | null)?.blur?.();
      void work.save();
    } else if (isCommand && event.key === "9") {
      event.preventDefault();
      work.session.fit();
    } else if (isCommand && !isTyping && step(work.session, event)) {
      event.preventDefault();
    } else if (event.key === "?" && !isTyping && !isCommand) {
      work.question.value = { kind: "shortcuts" };
    }
  };
  addEventListener("keydown", pressed);
  return () => removeEventListener("keydown", pressed);
}

/** Undoes, redoes or searches, wherever the focus is; false: the keys mean something else. */
function step(session: EditorSession, event: KeyboardEvent): boolean {
  const stack = session.service("commandStack");
  switch (event.shiftKey ? `Shift ${event.key.toLowerCase()}` : event.key.toLowerCase()) {
    case "z":
      stack.undo();
      return true;
    case "y":
    case "Shift z":
      stack.redo();
      return true;
    case "f":
      session.service("editorActions").trigger("find", {} as never);
      return true;
    default:
      return false;
  }
}

/** Tab goes from element to element in the order of the flow; at either end it leaves the canvas. */
export function stepThrough(session: EditorSession, event: KeyboardEvent): void {
  if (event.key !== "Tab" || event.ctrlKey || event.altKey) return;
  if ((event.target as HTMLElement).matches(".djs-palette")) return;
  const all = inOrder(session);
  const [selected] = session.selected.value;
  const at = selected ? all.findIndex(({ id }) => id === selected.id) : -1;
  const next = all[event.shiftKey ? (at < 0 ? all.length : at) - 1 : at + 1];
  if (!next) return;
  event.preventDefault();
  session.service("selection").select(next as never);
  session
    .service("canvas")
    .scrollToElement(next as never, { top: 80, bottom: 80, left: 80, right: 80 });
}

function inOrder(session: EditorSession): Element[] {
  const canvas = session.service("canvas");
  const root = canvas.getRootElement();
  const shown = session
    .service("elementRegistry")
    .filter(
      (each) =>
        each !== root && !("labelTarget" in each && each.labelTarget) && !("waypoints" in each),
    )
    .filter((each) => canvas.findRoot(each) === root) as unknown as (Element & Box)[];
  const elements = shown.filter((each) => !isEmptyPool(each));
  return elements.sort((a, b) => a.x + a.y * 0.2 - (b.x + b.y * 0.2));
}

interface Box {
  x: number;
  y: number;
}

function isEmptyPool(element: Element): boolean {
  const object = element.businessObject as ModdleElement;
  return object.$type === "bpmn:Lane" && list(object, "flowNodeRef").length === 0;
}
