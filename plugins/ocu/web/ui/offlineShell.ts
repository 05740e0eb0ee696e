// Says which files of the page its service worker keeps from the beginning: those that the first page
// needs, and the translations. Others are kept when they are loaded.
import type { Plugin, Rollup } from "vite";

type Bundle = Rollup.OutputBundle;

const TRANSLATION = /^assets\/de-/;

/** What is loaded first, what it imports, and their style sheets. */
function firstOf(bundle: Bundle): string[] {
  const found = new Set<string>();
  const add = (name: string): void => {
    const file = bundle[name];
    if (found.has(name) || file?.type !== "chunk") return;
    found.add(name);
    const made = (file as { viteMetadata?: { importedCss: Set<string> } }).viteMetadata;
    for (const style of made?.importedCss ?? []) found.add(style);
    file.imports.forEach(add);
  };
  for (const [name, file] of Object.entries(bundle)) {
    if (file.type === "chunk" && (file.isEntry || TRANSLATION.test(name))) add(name);
  }
  return [...found].sort();
}

export function offlineShell(): Plugin {
  return {
    name: "offline-shell",
    apply: "build",
    enforce: "post",
    generateBundle(_options, bundle) {
      // The name of the entry has a hash of all that it can load.
      const entry = Object.values(bundle).find((file) => file.type === "chunk" && file.isEntry);
      const files = ["/", "/favicon.svg", ...firstOf(bundle).map((name) => `/${name}`)];
      const shell = JSON.stringify({ version: entry?.fileName ?? "", files });
      this.emitFile({ type: "asset", fileName: "shell-files.js", source: `self.SHELL = ${shell};\n` });
    },
  };
}
