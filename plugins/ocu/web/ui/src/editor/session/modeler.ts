// bpmn-js with what missions need.
import { importBpmnDiagram } from "bpmn-js/lib/import/Importer";
import Modeler from "bpmn-js/lib/Modeler";
import type { OpenResult } from "bpmn-js/lib/BaseViewer";
import { CreateAppendAnythingModule } from "bpmn-js-create-append-anything";
import { BpmnPropertiesPanelModule, BpmnPropertiesProviderModule } from "bpmn-js-properties-panel";
import MinimapModule from "diagram-js-minimap";
import { blocksModule } from "../blocks";
import { m2pemDescriptor } from "../moddle/descriptor";
import { list, type ModdleElement } from "../moddle/moddle";
import { propertiesModule } from "../properties";
import type { Catalogue } from "./catalogue";
import { clipboardModule } from "./clipboard";
import { editsModule } from "./edits";
import { findingMarksModule } from "./findingMarks";
import { foreignCopyModule } from "./foreignCopy";
import { beside } from "./planes";
import { processesModule } from "./processes";
import type { Services } from "./services";
import { shownSelectionModule } from "./shownSelection";

/** Draws all diagrams of a file at once, where bpmn-js draws one: what is done in several of them is
 * on one command stack. One that draws again what another has drawn is drawn when it is opened. */
export class MissionModeler extends Modeler<Services> {
  override async open(diagram?: string | ModdleElement): Promise<OpenResult> {
    const { warnings } = await super.open(diagram as never);
    const canvas = this.get("canvas");
    const root = canvas.getRootElement();
    const definitions = this.getDefinitions() as ModdleElement;
    const shown = (root as unknown as { di: ModdleElement }).di.$parent!;
    try {
      for (const other of beside(shown, list(definitions, "diagrams"))) {
        const drawn = await importBpmnDiagram(this as never, definitions as never, other as never);
        warnings.push(...(drawn.warnings as unknown as typeof warnings));
      }
    } catch (error) {
      // Each of them can still be tried alone.
      const alone = await super.open(shown as never);
      return { warnings: [...alone.warnings, String(error)] };
    }
    canvas.setRootElement(root);
    return { warnings };
  }
}

export function makeModeler(catalogue: Catalogue, extra: object): MissionModeler {
  return new MissionModeler({
    moddleExtensions: { m2pem: m2pemDescriptor },
    additionalModules: [
      { catalogue: ["value", catalogue] },
      extra,
      editsModule,
      processesModule,
      clipboardModule,
      blocksModule,
      findingMarksModule,
      foreignCopyModule,
      shownSelectionModule,
      propertiesModule,
      BpmnPropertiesPanelModule,
      BpmnPropertiesProviderModule,
      CreateAppendAnythingModule,
      MinimapModule,
    ] as never[],
  });
}
