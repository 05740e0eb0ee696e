// Style sheets are written in px at the usual text size; here they become rem, so that the user's
// text size scales texts, buttons and the room around them together.
//
// Conditions on the width and height of the window become conditions on the container `page` in
// rem, since a media query knows nothing of the text size. Lines and shadows stay in px, as do lengths
// that are written with PX.
import type { AcceptedPlugin } from "postcss";

const ROOT_PX = 16;
const LENGTH = /(?<![\w.#-])(-?\d*\.?\d+)px\b/g;
const KEPT = /^(border(?!-spacing|-radius)|outline|box-shadow|text-shadow|background|stroke|filter)/;
const OF_WINDOW = /\b(width|height)\b/;

/** What is drawn into a diagram or map, which have a scale of their own. */
const DRAWN = /src\/map\/map\.css|verify\/canvas\.css/;
const DRAWN_PARTS = /\.m2-badge/;
/** Of the packages, what is read; the rest is drawn by programs that count in px. */
const READ = /djs-popup|djs-search|bio-properties-panel/;

const inRem = (text: string): string =>
  text.replace(LENGTH, (_whole, px: string) => `${Number(px) / ROOT_PX}rem`);

export function scaledSheets(): AcceptedPlugin {
  return {
    postcssPlugin: "scaled-sheets",
    AtRule: {
      media(rule) {
        if (rule.source?.input.file?.includes("node_modules")) return;
        if (!OF_WINDOW.test(rule.params) || !rule.params.includes("px")) return;
        rule.name = "container";
        rule.params = `page ${inRem(rule.params)}`;
      },
    },
    Declaration(declaration) {
      if (!declaration.value.includes("px") || KEPT.test(declaration.prop)) return;
      const file = declaration.source?.input.file ?? "";
      const rule = declaration.parent;
      const selector = rule?.type === "rule" ? rule.selector : "";
      if (DRAWN.test(file) || DRAWN_PARTS.test(selector)) return;
      if (file.includes("node_modules") && !READ.test(selector)) return;
      declaration.value = inRem(declaration.value);
    },
  };
}
