// An expression, formula or script, with what may come next.
import type { ComponentChildren } from "preact";
import { loaded } from "../../../shared/loaded";
import type { Token } from "../../condition/dialect";
import type { Suggestion } from "./Listbox";

export interface CodeSuggestion extends Suggestion {
  doc?: string;
}

export interface CodeSuggestions {
  /** What is replaced: from here to the cursor. */
  from: number;
  options: CodeSuggestion[];
}

export interface CodeFieldProps {
  id: string;
  label: string;
  value: string;
  write(value: string): void;
  suggest(typed: string, cursor: number): CodeSuggestions | Promise<CodeSuggestions>;
  tokens?(typed: string): Token[];
  /** Lines on what is written there. */
  explain?(typed: string, token: Token): string[];
  /** Where the text is wrong. */
  wrongAt: readonly number[];
  /** What the list of suggestions is called. */
  offered: string;
  rows: number;
  isOneLine?: boolean | undefined;
  required?: boolean | undefined;
  hint?: string | undefined;
  error?: string | undefined;
  /** What is shown below the text. */
  below?(typed: string): ComponentChildren;
}

/** The editor of code is large: it is loaded when the first is shown. */
export const CodeField = loaded<CodeFieldProps>(() => import("./CodeEditor"));
