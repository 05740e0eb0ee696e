// One requirement: what it is for, and its formula, or its pattern with arguments.
import { fill, strings } from "../../../strings";
import type { Finding } from "../../../shared/types";
import type { Requirement } from "../../moddle/requirements";
import { SelectField } from "../../properties/fields/SelectField";
import { TextField } from "../../properties/fields/TextField";
import type { EditorContext } from "../panel";
import { ArgumentField } from "./ArgumentField";
import type { Vocabulary } from "./completion";
import { FormulaField } from "./FormulaField";
import { InRuns } from "./InRuns";
import { PATTERNS, patternNamed, scopesOf, spaced, type Argument } from "./patterns";
import { isAboutThrown } from "./violation";
import { ofPattern } from "./written";

const words = strings.requirements;

export interface RequirementFormProps {
  editor: EditorContext;
  vocabulary: Vocabulary;
  prefix: string;
  requirement: Requirement;
  isTaken: boolean;
  findings: readonly Finding[];
  write(next: Requirement): void;
}

export function RequirementForm(props: RequirementFormProps) {
  const { prefix, requirement, findings, write } = props;
  const { ltl, pattern } = requirement;
  const known = patternNamed(pattern);
  const wrong = findings
    .filter((each) => !isAboutThrown(each))
    .map(({ message, remedy }) => [message, remedy].filter(Boolean).join(" "));
  return (
    <div class="m2v-requirement-form">
      <TextField
        id={`${prefix}-id`}
        label={words.id}
        required
        value={requirement.id}
        error={idError(props)}
        write={(id) => write({ ...requirement, id: id.trim() })}
      />
      <TextField
        id={`${prefix}-text`}
        label={words.text}
        hint={words.textHint}
        value={requirement.text}
        write={(text) => write({ ...requirement, text })}
      />
      <SelectField
        id={`${prefix}-pattern`}
        label={words.pattern}
        value={ltl === null ? pattern : ""}
        options={[
          { value: "", label: words.formula },
          ...PATTERNS.map(({ name, group }) => ({ value: name, label: spaced(name), group })),
        ]}
        hint={known?.meaning ?? words.formulaHint}
        write={(next) =>
          write(ofPattern({ ...requirement, pattern: next, ltl: next ? null : (ltl ?? "") }))
        }
      />
      {ltl === null ? (
        <>
          <Wrong texts={wrong} />
          <Arguments {...props} />
        </>
      ) : (
        <FormulaField
          id={`${prefix}-ltl`}
          label={words.ltl}
          required
          hint={words.ltlHint}
          value={ltl}
          vocabulary={props.vocabulary}
          isCondition={false}
          error={wrong.join("\n") || undefined}
          write={(next) => write({ ...requirement, ltl: next })}
        />
      )}
      <SelectField
        id={`${prefix}-fair`}
        label={words.fair}
        hint={words.fairHint}
        value={requirement.fair}
        options={[
          {
            value: "",
            label: fill(words.fairUsual, { fair: words.fairs[known?.fair ? "true" : "false"] }),
          },
          { value: "true", label: words.fairs.true },
          { value: "false", label: words.fairs.false },
        ]}
        write={(fair) => write({ ...requirement, fair: fair as Requirement["fair"] })}
      />
      <TextField
        id={`${prefix}-assume`}
        label={strings.verify.assume}
        hint={words.assumeHint}
        mono
        placeholder={strings.verify.assumeExample}
        value={requirement.assume}
        write={(assume) => write({ ...requirement, assume: assume.trim() })}
      />
      <InRuns
        prefix={prefix}
        requirement={requirement}
        signals={props.editor.checks.outline.value?.signals ?? []}
        findings={findings.filter(isAboutThrown)}
        write={write}
      />
    </div>
  );
}

function idError({ requirement, isTaken }: RequirementFormProps): string | undefined {
  if (requirement.id === "") return words.idNeeded;
  return isTaken ? words.idTaken : undefined;
}

function Wrong({ texts }: { texts: readonly string[] }) {
  return texts.map((each) => (
    <p key={each} class="m2-field-error" role="alert">
      {each}
    </p>
  ));
}

function Arguments(props: RequirementFormProps) {
  const { requirement } = props;
  const known = patternNamed(requirement.pattern);
  if (!known) {
    return (
      <p class="m2-field-error">{fill(words.unknownPattern, { pattern: requirement.pattern })}</p>
    );
  }
  const scopes = scopesOf(known);
  const isScoped = scopes.some(({ name }) => name in requirement.args);
  return (
    <>
      {known.arguments.map((argument) => (
        <OneArgument key={argument.name} {...props} argument={argument} />
      ))}
      {scopes.length > 0 && (
        <details class="m2v-scopes" open={isScoped}>
          <summary>{words.scope}</summary>
          <p class="m2-field-hint">{words.scopeHint}</p>
          {scopes.map((argument) => (
            <OneArgument key={argument.name} {...props} argument={argument} />
          ))}
        </details>
      )}
    </>
  );
}

function OneArgument(props: RequirementFormProps & { argument: Argument }) {
  const { editor, vocabulary, prefix, requirement, argument, write } = props;
  return (
    <ArgumentField
      editor={editor}
      vocabulary={vocabulary}
      id={`${prefix}-${argument.name}`}
      argument={argument}
      values={requirement.args[argument.name] ?? []}
      asked={requirement.args["ask"]?.[0] ?? ""}
      write={(values) => {
        const { [argument.name]: _, ...others } = requirement.args;
        const args = values.length ? { ...others, [argument.name]: values } : others;
        write({ ...requirement, args });
      }}
    />
  );
}
