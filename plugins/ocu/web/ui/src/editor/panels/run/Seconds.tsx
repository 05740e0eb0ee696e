// A field for a time in seconds.
import { strings } from "../../../strings";
import { TextField } from "../../properties/fields/TextField";
import { isSeconds } from "./answers";

export interface SecondsProps {
  id: string;
  label: string;
  value: string;
  required?: boolean;
  write(value: string): void;
}

export function Seconds({ id, label, value, required = false, write }: SecondsProps) {
  const isGood = isSeconds(value) || (!required && value.trim() === "");
  return (
    <TextField
      id={id}
      label={label}
      required={required}
      value={value}
      error={isGood ? undefined : strings.run.answers.seconds}
      write={write}
    />
  );
}
