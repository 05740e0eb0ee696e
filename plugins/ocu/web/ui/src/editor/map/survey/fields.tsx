// Fields of forms on the map: a number with a slider beside it, and a number alone.
import { useUniqueId } from "../../../shared/uniqueId";

export interface NumberFieldProps {
  label: string;
  value: number | null;
  set(value: number | null): void;
  min: number;
  max: number;
  step?: number | "any";
  placeholder?: string;
  /** Whether it may be left empty. */
  optional?: boolean;
}

export function NumberField(props: NumberFieldProps) {
  const { label, value, set, min, max, step = "any", placeholder, optional = false } = props;
  return (
    <label class="plan-field">
      {label}
      <input
        type="number"
        min={min}
        max={max}
        step={step}
        value={value ?? ""}
        placeholder={placeholder}
        onInput={({ currentTarget: { value: typed, valueAsNumber, validity } }) => {
          if (typed === "" && optional) set(null);
          else if (Number.isFinite(valueAsNumber) && !validity.rangeOverflow && !validity.rangeUnderflow)
            set(valueAsNumber);
        }}
      />
    </label>
  );
}

export interface SliderProps {
  label: string;
  value: number;
  set(value: number): void;
  min: number;
  max: number;
  step: number;
  /** Of the number; the slider ends earlier. */
  most?: number;
}

export function Slider({ label, value, set, min, max, step, most = max }: SliderProps) {
  const id = useUniqueId();
  return (
    <div class="plan-slider">
      <label for={id}>{label}</label>
      <input
        type="range"
        aria-label={label}
        min={min}
        max={max}
        step={step}
        value={value}
        onInput={({ currentTarget }) => set(currentTarget.valueAsNumber)}
      />
      <input
        id={id}
        type="number"
        min={min}
        max={most}
        step="any"
        value={value}
        onInput={({ currentTarget: { valueAsNumber, validity } }) => {
          if (Number.isFinite(valueAsNumber) && !validity.rangeOverflow && !validity.rangeUnderflow)
            set(valueAsNumber);
        }}
      />
    </div>
  );
}
