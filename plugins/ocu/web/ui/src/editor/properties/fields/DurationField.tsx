// A duration: shown as people write it, kept in ISO 8601. Expressions and other words are kept too.
import { isIsoDuration, shownDuration, writtenDuration } from "../../session/durations";
import { isExpression } from "../../session/quantities";
import { strings } from "../../../strings";
import { TextField, type TextFieldProps } from "./TextField";

const words = strings.editor.durations;

export interface DurationFieldProps extends TextFieldProps {
  /** What it may say in place of a duration: "unlimited". */
  others?: readonly string[];
}

export function DurationField({ others = [], ...props }: DurationFieldProps) {
  const { value } = props;
  const isFine =
    value === "" || isExpression(value) || isIsoDuration(value) || others.includes(value);
  return (
    <TextField
      {...props}
      placeholder={props.placeholder ?? words.example}
      value={shownDuration(value)}
      error={props.error ?? (isFine ? undefined : words.wrong)}
      write={(typed) => props.write(writtenDuration(typed))}
    />
  );
}
