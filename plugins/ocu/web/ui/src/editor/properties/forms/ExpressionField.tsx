// A condition or script, with what may come next, and with what the check says of it.
import { loaded } from "../../../shared/loaded";
import type { Finding } from "../../../shared/types";
import type { FormProps } from "../form";

export interface ExpressionFieldProps {
  form: FormProps;
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  /** That the file gives the expression. */
  language?: string;
  hint?: string;
  rows?: number;
  /** What the check says of the element. */
  findings?: readonly Finding[];
}

/** An editor of code: for those who look at an expression. */
export const ExpressionField = loaded<ExpressionFieldProps>(() => import("./ExpressionCode"));
