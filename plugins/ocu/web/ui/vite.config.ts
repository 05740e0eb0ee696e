import preact from "@preact/preset-vite";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";
import { offlineShell } from "./offlineShell.ts";
import { scaledSheets } from "./scaledSheets.ts";

const NOTHING = "/src/editor/stubs/nothing.ts";
const NEVER_SHOWN = /^@bpmn-io\/(feel-editor|feelers-editor)$|^@codemirror\//;

/**
 * The properties panel brings a Preact of its own; two of them do not see each other's components.
 * It also brings editors for FEEL and JSON that missions have no use for.
 */
function leanPropertiesPanel(): Plugin {
  return {
    name: "lean-properties-panel",
    enforce: "pre",
    resolveId(source, importer) {
      if (!importer?.includes("properties-panel")) return null;
      if (NEVER_SHOWN.test(source)) return this.resolve(NOTHING, undefined, { skipSelf: true });
      const own = /^(?:\.\.|@bpmn-io\/properties-panel)\/preact(\/.*)?$/.exec(source);
      return own ? this.resolve(`preact${own[1] ?? ""}`, importer, { skipSelf: true }) : null;
    },
  };
}

// The page is served by m2pem_plugin_web, from the folder that is built here.
export default defineConfig({
  plugins: [leanPropertiesPanel(), preact(), offlineShell()],
  css: { postcss: { plugins: [scaledSheets()] } },
  build: {
    outDir: "../m2pem_plugin_web/static",
    emptyOutDir: true,
    license: { fileName: "licenses.md" },
    target: "es2022",
    // The largest is the modeler; what all pages load is bounded by a test.
    chunkSizeWarningLimit: 2000,
  },
  // For work on the page alone: `npm run dev`, beside `m2pem serve --ocu web`.
  server: {
    host: "127.0.0.1",
    proxy: { "/api": { target: "http://127.0.0.1:8700", ws: true } },
  },
  test: { environment: "node", include: ["src/**/*.test.ts"] },
});
