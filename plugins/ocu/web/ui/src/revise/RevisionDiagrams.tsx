// What a run has now and what it would go on with, side by side.
import { Comparison } from "../compare/Comparison";
import { get } from "../shared/api";
import { Dialog } from "../shared/Dialog";
import type { Fleet } from "../shared/types";
import { fill, strings } from "../strings";
import type { NewVersion } from "./plan";
import { presentXml, xmlOf } from "./versions";

const words = strings.revise;

export interface RevisionDiagramsProps {
  run: string;
  version: NewVersion;
  onClose(): void;
}

export default function RevisionDiagrams({ run, version, onClose }: RevisionDiagramsProps) {
  const read = async () => {
    const [before, after, fleet] = await Promise.all([
      presentXml(run),
      xmlOf(run, version),
      get<Fleet>("/fleet"),
    ]);
    return { before, after, fleet };
  };
  return (
    <Dialog title={fill(words.diagramsOf, { run })} onClose={onClose} full>
      <Comparison read={read} of={JSON.stringify(version)} />
    </Dialog>
  );
}
