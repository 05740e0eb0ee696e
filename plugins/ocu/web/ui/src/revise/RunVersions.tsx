// The versions of its mission that a run has had: since when, by whom, and which other runs have
// them. The run can be revised back to an earlier one.
import { useEffect, useState } from "preact/hooks";
import { Dialog } from "../shared/Dialog";
import { dateTime } from "../shared/format";
import { may } from "../shared/session";
import { fill, strings } from "../strings";
import { shortOf } from "./plan";
import { revising } from "./revising";
import { versionsOfRun, type RunVersion } from "./versions";
import "./revise.css";

const words = strings.revise;

export interface RunVersionsProps {
  run: string;
  /** Whether the run is under way. */
  isLive: boolean;
  onClose(): void;
}

export default function RunVersions({ run, isLive, onClose }: RunVersionsProps) {
  const [found, setFound] = useState<readonly RunVersion[] | null>(null);
  const [problem, setProblem] = useState("");
  useEffect(() => {
    versionsOfRun(run).then(setFound, (error: unknown) =>
      setProblem(error instanceof Error ? error.message : String(error)),
    );
  }, [run]);
  const present = found?.at(-1);
  const back = ({ version }: RunVersion, number: number) => {
    onClose();
    revising.value = { run, version: { kind: "had", version, number } };
  };
  return (
    <Dialog title={fill(words.versionsOf, { run })} onClose={onClose} wide>
      {problem && <p role="alert">{problem}</p>}
      {!found && !problem && <p role="status">{strings.shell.loading}</p>}
      <ol class="rev-versions" aria-label={words.versions}>
        {found?.map((each, at) => (
          <li key={each.seq}>
            <p>
              <b>{fill(words.versionNumber, { number: at + 1 })}</b>{" "}
              <code title={each.version}>{shortOf(each.version)}</code>{" "}
              {each === present && <em>{isLive ? words.present : words.last}</em>}
            </p>
            <p>
              {fill(each.by ? words.since : words.sinceBare, {
                at: dateTime(each.at_us),
                by: each.by,
                seq: each.seq,
              })}
            </p>
            <p>{each.mission}</p>
            {each.shared_with.length > 0 && (
              <p>{fill(words.sharedWith, { runs: each.shared_with.join(", ") })}</p>
            )}
            {isLive && may("operator") && each.version !== present?.version && (
              <button type="button" class="secondary" onClick={() => back(each, at + 1)}>
                {words.back}
              </button>
            )}
          </li>
        ))}
      </ol>
    </Dialog>
  );
}
