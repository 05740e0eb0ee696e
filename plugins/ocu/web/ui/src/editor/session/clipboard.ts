// Copy and paste through the clipboard of the machine: between tabs, windows and missions.
// Where the browser does not let the page read it, what was copied on this page is pasted.
import type { ModdleElement } from "../moddle/moddle";
import type { EventBus } from "./services";

const PREFIX = "m2pem-elements:";

/** After the parts that say what may be copied, before bpmn-js fills its own clipboard. */
const LATE = 2050;

type Tree = Record<string, unknown>;

interface PasteContext {
  tree?: Tree;
  [more: string]: unknown;
}

interface CopyPaste {
  paste(context: PasteContext): void;
}

interface OwnClipboard {
  get(): Tree | undefined;
}

interface Moddle {
  create(type: string, properties: object): ModdleElement;
  createAny(type: string, uri: string, properties: object): ModdleElement;
  getTypeDescriptor(type: string): object | undefined;
}

export class SystemClipboard {
  static readonly $inject = ["eventBus", "copyPaste", "clipboard", "moddle"];

  constructor(
    eventBus: EventBus,
    private readonly copyPaste: CopyPaste,
    private readonly own: OwnClipboard,
    private readonly moddle: Moddle,
  ) {
    const { clipboard } = navigator as { clipboard?: Clipboard };
    if (!clipboard) return;
    const copied = ({ tree }: { tree: Tree }) => {
      clipboard.writeText(PREFIX + JSON.stringify(tree, withNamespace)).catch(() => undefined);
    };
    const pasting = (context: PasteContext) => {
      if (context.tree) return undefined;
      void this.paste(clipboard, { ...context });
      return false;
    };
    eventBus.on("copyPaste.elementsCopied", LATE, copied as never);
    eventBus.on("copyPaste.pasteElements", LATE, pasting as never);
  }

  private async paste(clipboard: Clipboard, context: PasteContext): Promise<void> {
    const text = await clipboard.readText().catch(() => undefined);
    const tree = text?.startsWith(PREFIX) ? this.read(text.slice(PREFIX.length)) : undefined;
    const found = tree ?? (text === undefined ? this.own.get() : undefined);
    if (found && Object.keys(found).length) this.copyPaste.paste({ ...context, tree: found });
  }

  private read(text: string): Tree | undefined {
    const byId = new Map<string, ModdleElement>();
    try {
      return JSON.parse(text, (_, value: unknown) => this.revived(value, byId)) as Tree;
    } catch {
      return undefined;
    }
  }

  private revived(value: unknown, byId: Map<string, ModdleElement>): unknown {
    if (typeof value !== "object" || value === null || !("$type" in value)) return value;
    const { $type, $uri, ...properties } = value as Record<string, unknown>;
    const { id } = properties;
    const known = typeof id === "string" ? byId.get(id) : undefined;
    if (known) return known;
    const type = String($type);
    if (!this.moddle.getTypeDescriptor(type)) {
      return this.moddle.createAny(type, String($uri ?? ""), properties);
    }
    const made = this.moddle.create(type, properties);
    if (typeof id === "string" && !type.startsWith("m2pem:")) byId.set(id, made);
    return made;
  }
}

/** An element of another tool goes with its namespace, which cannot be told from its type. */
function withNamespace(_: string, value: unknown): unknown {
  const descriptor = (value as ModdleElement | null)?.$descriptor as
    { isGeneric?: boolean; ns?: { uri: string } } | undefined;
  if (!descriptor?.isGeneric) return value;
  return { ...(value as object), $uri: descriptor.ns?.uri };
}

export const clipboardModule = {
  __init__: ["systemClipboard"],
  systemClipboard: ["type", SystemClipboard],
};
