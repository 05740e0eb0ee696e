// A formula, with what may come next.
import { strings } from "../../../strings";
import { CodeField } from "../../properties/fields/CodeField";
import { Caret } from "../ProblemView";
import { completeFormula, type Vocabulary } from "./completion";

const words = strings.requirements;

export interface FormulaFieldProps {
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  vocabulary: Vocabulary;
  /** An element alone means its completion. */
  isCondition: boolean;
  required?: boolean;
  hint?: string | undefined;
  error?: string | undefined;
}

export function FormulaField({ vocabulary, isCondition, ...field }: FormulaFieldProps) {
  const { error } = field;
  return (
    <CodeField
      {...field}
      rows={isCondition ? 1 : 3}
      isOneLine={isCondition}
      wrongAt={[]}
      offered={words.offered}
      suggest={(typed, cursor) => {
        const { from, options } = completeFormula(typed, cursor, vocabulary, isCondition);
        return {
          from,
          options: options.map((each) => ({ ...each, group: words.groups[each.group] })),
        };
      }}
      below={(typed) => error && <Caret message={error} formula={typed} />}
    />
  );
}
