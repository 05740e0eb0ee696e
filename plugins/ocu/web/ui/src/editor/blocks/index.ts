import { Fragments } from "./control/placing";
import { searchByIntent } from "./control/search";
import { BlockMenus } from "./menus";
import { BlockRenderer } from "./BlockRenderer";

export const blocksModule = {
  __init__: ["blockMenus", "blockRenderer", "fragments"],
  fragments: ["type", Fragments],
  search: ["value", searchByIntent],
  blockMenus: ["type", BlockMenus],
  blockRenderer: ["type", BlockRenderer],
};
