// BPMN files, read as bpmn-js reads them.
import NavigatedViewer from "bpmn-js/lib/NavigatedViewer";
import type { Definitions } from "./moddle";

interface Reader {
  fromXML(xml: string): Promise<{ rootElement: Definitions }>;
}

export async function readDefinitions(xml: string): Promise<Definitions> {
  const viewer = new NavigatedViewer();
  try {
    return (await viewer.get<Reader>("moddle").fromXML(xml)).rootElement;
  } finally {
    viewer.destroy();
  }
}
