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
import { blocksOf, controlBlock, type Block } from "./blocks";
import { isOpen, type Fragments } from "./control/placing";
import { BLOCK_CLASS, intendedEntry } from "./control/search";
import { iconSvg } from "./icons";
import { draggingOf, makeShape } from "./making";
import { becomeBlock, takesPlace } from "./putting";

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
    "fragments",
  ];
  private readonly blocks: Block[];

  constructor(
    private readonly popupMenu: PopupMenu,
    readonly catalogue: Catalogue,
    private readonly elementFactory: ElementFactory,
    private readonly create: Create,
    private readonly autoPlace: Services["autoPlace"],
    private readonly rules: Rules,
    private readonly mouse: Mouse,
    readonly edits: Edits,
    readonly fragments: Fragments,
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
        ? this.entries("replace", (block) => this.replacing(target, block), mayTakeItsPlace(target))
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

  private entries(
    prefix: string,
    actions: (block: Block) => Actions,
    isMeant: (block: Block) => boolean = () => true,
  ): PopupMenuEntries {
    const entries: PopupMenuEntries = {};
    for (const block of this.blocks.filter(isMeant)) {
      const entry = (each: Block) => entryOf(each, actions(each) as unknown as PopupMenuEntryAction);
      const { content } = block;
      entries[`${prefix}-block-${block.id}`] =
        content.kind === "fragment"
          ? intendedEntry(entry(block), content.of, (options) =>
              entry(controlBlock(this.catalogue, content.of, options)),
            )
          : entry(block);
    }
    return entries;
  }

  private shape(block: Block): Element {
    return makeShape(this.edits.factory, this.elementFactory, this.catalogue, block);
  }

  private creating(block: Block): Actions {
    const start = (event: Event) => {
      this.popupMenu.close();
      const at = event instanceof KeyboardEvent ? this.mouse.getLastMoveEvent() : event;
      this.create.start(at, this.shape(block), draggingOf(block));
    };
    return { click: start, dragstart: start };
  }

  private appending(source: Element, block: Block): Actions {
    return {
      click: () => {
        this.popupMenu.close();
        if (!takesPlace(this, source, block)) {
          this.autoPlace.append(source, this.shape(block));
        }
      },
      dragstart: (event) => {
        this.popupMenu.close();
        this.create.start(event, this.shape(block), { source, ...draggingOf(block) });
      },
    };
  }

  private replacing(element: Element, block: Block): Actions {
    const replace = () => {
      this.popupMenu.close();
      becomeBlock(this, element, block);
    };
    return { click: replace, dragstart: replace };
  }
}

function entryOf(block: Block, action: PopupMenuEntryAction) {
  return {
    label: block.title,
    title: block.doc || block.title,
    search: `${block.word} ${block.doc}`,
    imageHtml: iconSvg(block.group),
    className: BLOCK_CLASS,
    group: { id: `m2-${block.group}`, name: strings.editor.blocks.groups[block.group] },
    action,
  };
}

/** Fragments take the place of what is still open, and of nothing else. */
function mayTakeItsPlace(target: Element) {
  return ({ content }: Block) => content.kind !== "fragment" || isOpen(target);
}

function canBecomeBlock(element: ModdleElement): boolean {
  return isA(element, "bpmn:Task") || isA(element, "bpmn:CallActivity");
}
