import { BlockMenus } from "./menus";
import { BlockRenderer } from "./BlockRenderer";

export const blocksModule = {
  __init__: ["blockMenus", "blockRenderer"],
  blockMenus: ["type", BlockMenus],
  blockRenderer: ["type", BlockRenderer],
};
