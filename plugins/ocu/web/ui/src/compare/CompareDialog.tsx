// Two versions of the mission of the editor side by side, which its user chooses.
import { useEffect, useState } from "preact/hooks";
import type { EditorSession } from "../editor/session/EditorSession";
import { openVersion, versionsOf, type Version } from "../missions/files";
import { Dialog } from "../shared/Dialog";
import { moment } from "../shared/moments";
import { fill, strings } from "../strings";
import { Comparison } from "./Comparison";
import { comparing, type Side } from "./comparing";

const words = strings.compare;

export default function CompareDialog({ editor }: { editor: EditorSession }) {
  const { before, after } = comparing.value!;
  const [versions, setVersions] = useState<readonly Version[]>([]);
  const xmlOf = async (side: Side) =>
    side === "drawn" ? editor.xml() : (await openVersion(editor.mission, side)).xml;
  const read = async () => {
    const [old, now] = await Promise.all([xmlOf(before), xmlOf(after)]);
    return { before: old, after: now, fleet: editor.catalogue.fleet };
  };
  useEffect(() => {
    let left = false;
    // What is compared is shown all the same where the list of versions cannot be read.
    versionsOf(editor.mission).then(
      (all) => {
        if (!left) setVersions([...all].reverse());
      },
      (error: unknown) => console.warn(error),
    );
    return () => {
      left = true;
    };
  }, [before, after]);
  return (
    <Dialog
      title={fill(words.title, { name: editor.mission })}
      onClose={() => (comparing.value = null)}
      full
    >
      <Comparison read={read} of={`${before} ${after}`}>
        <SideChoice
          label={words.before}
          value={before}
          versions={versions}
          choose={(side) => (comparing.value = { before: side, after })}
        />
        <SideChoice
          label={words.after}
          value={after}
          versions={versions}
          choose={(side) => (comparing.value = { before, after: side })}
        />
      </Comparison>
    </Dialog>
  );
}

interface SideChoiceProps {
  label: string;
  value: Side;
  versions: readonly Version[];
  choose(side: Side): void;
}

function SideChoice({ label, value, versions, choose }: SideChoiceProps) {
  return (
    <label>
      {label}{" "}
      <select
        value={String(value)}
        onChange={({ currentTarget: { value: next } }) =>
          choose(next === "drawn" ? "drawn" : Number(next))
        }
      >
        <option value="drawn">{words.drawn}</option>
        {versions.map(({ number, by, saved_at_us }) => (
          <option key={number} value={String(number)}>
            {fill(by ? words.version : words.versionBare, {
              number,
              by,
              at: moment(saved_at_us / 1000),
            })}
          </option>
        ))}
      </select>
    </label>
  );
}
