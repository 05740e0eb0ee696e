import preact from "@preact/preset-vite";
import { defineConfig } from "vitest/config";

// The page is served by m2pem_plugin_web, from the folder that is built here.
export default defineConfig({
  plugins: [preact()],
  build: {
    outDir: "../m2pem_plugin_web/static",
    emptyOutDir: true,
    license: { fileName: "licenses.md" },
    target: "es2022",
  },
  // For work on the page alone: `npm run dev`, beside `m2pem serve --ocu web`.
  server: {
    host: "127.0.0.1",
    proxy: { "/api": { target: "http://127.0.0.1:8700", ws: true } },
  },
  test: { environment: "node", include: ["src/**/*.test.ts"] },
});
