// bpmn-js with what missions need.
import Modeler from "bpmn-js/lib/Modeler";
import { CreateAppendAnythingModule } from "bpmn-js-create-append-anything";
import { BpmnPropertiesPanelModule, BpmnPropertiesProviderModule } from "bpmn-js-properties-panel";
import MinimapModule from "diagram-js-minimap";
import { blocksModule } from "../blocks";
import { m2pemDescriptor } from "../moddle/descriptor";
import { propertiesModule } from "../properties";
import type { Catalogue } from "./catalogue";
import { clipboardModule } from "./clipboard";
import { editsModule } from "./edits";
import { findingMarksModule } from "./findingMarks";
import { foreignCopyModule } from "./foreignCopy";
import type { Services } from "./services";

export type MissionModeler = Modeler<Services>;

export function makeModeler(catalogue: Catalogue, extra: object): MissionModeler {
  return new Modeler<Services>({
    moddleExtensions: { m2pem: m2pemDescriptor },
    additionalModules: [
      { catalogue: ["value", catalogue] },
      extra,
      editsModule,
      clipboardModule,
      blocksModule,
      findingMarksModule,
      foreignCopyModule,
      propertiesModule,
      BpmnPropertiesPanelModule,
      BpmnPropertiesProviderModule,
      CreateAppendAnythingModule,
      MinimapModule,
    ] as never[],
  });
}
