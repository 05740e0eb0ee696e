// A run goes on with a new version of its mission: the plan is shown before anything is done, and
// only what was shown is done.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { ApiError } from "../shared/api";
import { Dialog } from "../shared/Dialog";
import { loaded } from "../shared/loaded";
import { may } from "../shared/session";
import { toast } from "../shared/Toasts";
import type { Finding } from "../shared/types";
import { fill, strings } from "../strings";
import { Findings, PlanView } from "./PlanView";
import { VersionChoice } from "./VersionChoice";
import {
  choicesWith,
  needsConfirmation,
  shortOf,
  type Choice,
  type Moves,
  type NewVersion,
  type Plan,
} from "./plan";
import { planOf, revise } from "./requests";
import "./revise.css";

const words = strings.revise;

/** The viewer of diagrams and the differ: for those who look at both diagrams. */
const RevisionDiagrams = loaded(() => import("./RevisionDiagrams"));

interface Problem {
  title: string;
  text: string;
  findings: readonly Finding[];
}

export interface ReviseDialogProps {
  run: string;
  /** What is chosen at first. */
  version: NewVersion | null;
  onClose(): void;
}

export default function ReviseDialog({ run, version, onClose }: ReviseDialogProps) {
  const chosen = useSignal<NewVersion | null>(null);
  const moves = useSignal<Moves>({});
  const choices = useSignal<readonly Choice[]>([]);
  const plan = useSignal<Plan | null>(null);
  const busy = useSignal("");
  const problem = useSignal<Problem | null>(null);
  const isOther = useSignal(false);
  const evenIfStuck = useSignal(false);
  const showsDiagrams = useSignal(false);
  /** Which request for a plan was the last: an answer to an earlier one is dropped. */
  const asked = useRef(0);

  const fail = (title: string, error: unknown) => {
    const findings = error instanceof ApiError ? (error.problem.findings ?? []) : [];
    problem.value = {
      title,
      text: error instanceof Error ? error.message : String(error),
      findings,
    };
  };
  const makePlan = async () => {
    const wanted = chosen.value;
    const number = (asked.current += 1);
    plan.value = problem.value = null;
    isOther.value = evenIfStuck.value = false;
    busy.value = "";
    if (!wanted) return;
    busy.value = words.planning;
    try {
      const found = await planOf(run, wanted, moves.value);
      if (number !== asked.current) return;
      plan.value = found;
      choices.value = choicesWith(choices.value, found);
    } catch (error) {
      if (number === asked.current) fail(words.failed, error);
    }
    if (number === asked.current) busy.value = "";
  };
  const choose = (version: NewVersion | null) => {
    chosen.value = version;
    moves.value = {};
    choices.value = [];
    void makePlan();
  };
  const move = (element: string, target: string | undefined) => {
    const { [element]: _, ...others } = moves.value;
    moves.value = target === undefined ? others : { ...others, [element]: target };
    void makePlan();
  };
  const act = async () => {
    const [wanted, shown] = [chosen.value, plan.value];
    if (!wanted || !shown || busy.value) return;
    busy.value = words.acting;
    problem.value = null;
    try {
      await revise(run, wanted, moves.value, shown.plan, evenIfStuck.value);
    } catch (error) {
      await explain(error, shown);
      return;
    }
    toast(fill(words.done, { run, version: shortOf(shown.version) }), "good");
    onClose();
  };
  /** Why it was not done; if the plan is another one by now, it is shown instead. */
  const explain = async (error: unknown, shown: Plan) => {
    await makePlan();
    const now = plan.value as Plan | null;
    if (error instanceof ApiError && now && now.plan !== shown.plan) isOther.value = true;
    else fail(words.notDone, error);
  };

  useEffect(() => {
    if (version) choose(version);
  }, []);

  const shown = plan.value;
  const isStuck = shown !== null && needsConfirmation(shown);
  const isReady = shown !== null && shown.possible && (!isStuck || evenIfStuck.value);
  return (
    <Dialog
      title={fill(words.title, { run })}
      onClose={onClose}
      wide
      actions={
        <>
          {!may("commander") && <span>{words.notAllowed}</span>}
          <button type="button" class="secondary" onClick={onClose}>
            {strings.shell.close}
          </button>
          {may("commander") && (
            <button
              type="button"
              class="primary"
              disabled={!isReady || busy.value !== ""}
              onClick={() => void act()}
            >
              {fill(words.act, { run })}
            </button>
          )}
        </>
      }
    >
      <div class="rev" tabIndex={-1}>
        <VersionChoice
          run={run}
          chosen={chosen.value}
          choose={choose}
          fail={(error) => fail(words.failed, error)}
        />
        <p role="status" class="rev-state">
          {busy.value || (isOther.value ? <strong>{words.other}</strong> : !shown && words.first)}
        </p>
        {problem.value && (
          <section role="alert" class="rev-bad">
            <h3>{problem.value.title}</h3>
            <p>{problem.value.text}</p>
            <Findings found={problem.value.findings} />
          </section>
        )}
        {shown && (
          <PlanView
            plan={shown}
            choices={choices.value}
            moves={moves.value}
            move={move}
            compare={() => (showsDiagrams.value = true)}
          />
        )}
        {showsDiagrams.value && chosen.value && (
          <RevisionDiagrams
            run={run}
            version={chosen.value}
            onClose={() => (showsDiagrams.value = false)}
          />
        )}
        {isStuck && shown.possible && may("commander") && (
          <label class="switch">
            <input
              type="checkbox"
              checked={evenIfStuck.value}
              onChange={(event) => (evenIfStuck.value = event.currentTarget.checked)}
            />
            {words.stuck}
          </label>
        )}
      </div>
    </Dialog>
  );
}
