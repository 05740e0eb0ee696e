// Blocks in the create, append and replace menus, before BPMN's own elements.
import type {
  PopupMenuEntries,
  PopupMenuEntriesProvider,
  PopupMenuEntryAction,
} from "diagram-js/lib/features/popup-menu/PopupMenuProvider";
import { strings } from "../../strings";
import { isA, type ModdleElement } from "../moddle/moddle";
import type { Catalogue } from "../session/catalogue";
import type { Edits } from "../session/edits";
import type {
  Create,
  Element,
  ElementFactory,
  PopupMenu,
  Rules,
  Services,
} from "../session/services";
import { blocksOf, type Block } from "./blocks";
import { iconSvg } from "./icons";
import { contentChanges, makeShape, typeOf } from "./making";

const BEFORE_BPMN = 1500;

/** How an entry is used: clicked, or dragged to a place. */
type Actions = Record<"click" | "dragstart", (event: Event) => void>;

interface Mouse {
  getLastMoveEvent(): MouseEvent;
}

export class BlockMenus {
  static readonly $inject = [
    "popupMenu",
    "catalogue",
    "elementFactory",
    "create",
    "autoPlace",
    "rules",
    "mouse",
    "edits",
  ];
  private readonly blocks: Block[];

  constructor(
    private readonly popupMenu: PopupMenu,
    catalogue: Catalogue,
    private readonly elementFactory: ElementFactory,
    private readonly create: Create,
    private readonly autoPlace: Services["autoPlace"],
    private readonly rules: Rules,
    private readonly mouse: Mouse,
    private readonly edits: Edits,
  ) {
    this.blocks = blocksOf(catalogue);
    this.register("bpmn-create", () => this.entries("create", (block) => this.creating(block)));
    this.register("bpmn-append", (target) =>
      this.rules.allowed("shape.append", { element: target })
        ? this.entries("append", (block) => this.appending(target, block))
        : {},
    );
    this.register("bpmn-replace", (target) =>
      canBecomeBlock(target.businessObject)
        ? this.entries("replace", (block) => this.replacing(target, block))
        : {},
    );
  }

  private register(menu: string, make: (target: Element) => PopupMenuEntries): void {
    const provider = {
      getPopupMenuEntries(target: unknown): PopupMenuEntriesProvider | PopupMenuEntries {
        if (Array.isArray(target)) return {};
        return make(target as Element);
      },
    };
    this.popupMenu.registerProvider(menu, BEFORE_BPMN, provider as never);
  }

  private entries(prefix: string, actions: (block: Block) => Actions): PopupMenuEntries {
    const entries: PopupMenuEntries = {};
    for (const block of this.blocks) {
      entries[`${prefix}-block-${block.id}`] = {
        label: block.title,
        title: block.doc || block.title,
        search: `${block.word} ${block.doc}`,
        imageHtml: iconSvg(block.group),
        className: "m2-block-entry",
        group: { id: `m2-${block.group}`, name: strings.editor.blocks.groups[block.group] },
        action: actions(block) as unknown as PopupMenuEntryAction,
      };
    }
    return entries;
  }

  private shape(block: Block): Element {
    return makeShape(this.edits.factory, this.elementFactory, block);
  }

  private creating(block: Block): Actions {
    const start = (event: Event) => {
      this.popupMenu.close();
      const at = event instanceof KeyboardEvent ? this.mouse.getLastMoveEvent() : event;
      this.create.start(at, this.shape(block));
    };
    return { click: start, dragstart: start };
  }

  private appending(source: Element, block: Block): Actions {
    return {
      click: () => {
        this.popupMenu.close();
        this.autoPlace.append(source, this.shape(block));
      },
      dragstart: (event) => {
        this.popupMenu.close();
        this.create.start(event, this.shape(block), { source });
      },
    };
  }

  private replacing(element: Element, block: Block): Actions {
    const replace = () => {
      this.popupMenu.close();
      this.edits.replace(element, typeOf(block), (task) =>
        becoming(this.edits, block, element.businessObject, task),
      );
    };
    return { click: replace, dragstart: replace };
  }
}

/** The changes that turn a task into a block; a name that people gave it stays. */
function becoming(edits: Edits, block: Block, before: ModdleElement, task: ModdleElement) {
  const changes = contentChanges(edits.factory, block, task);
  if (before.get("name")) return changes;
  return [...changes, { target: task, properties: { name: block.title } }];
}

function canBecomeBlock(element: ModdleElement): boolean {
  return isA(element, "bpmn:Task") || isA(element, "bpmn:CallActivity");
}
