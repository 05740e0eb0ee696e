// What is selected, in fields. The panel itself is bpmn-js's; its groups are ours.
import { useEffect, useRef } from "preact/hooks";
import { strings } from "../../strings";
import type { EditorContext, Panel } from "./panel";

export const propertiesPanel: Panel = {
  id: "properties",
  title: strings.editor.panels.properties,
  render: (editor) => <Properties editor={editor} />,
};

function Properties({ editor }: { editor: EditorContext }) {
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const panel = editor.service("propertiesPanel");
    if (place.current) panel.attachTo(place.current);
    return () => panel.detach();
  }, [editor]);
  // Keys that are pressed here are for the fields, not for the canvas.
  return <div class="m2-properties" ref={place} />;
}
