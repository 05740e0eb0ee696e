// A list in which rows are added, removed and moved.
import type { ComponentChildren } from "preact";
import { fill, strings } from "../../../strings";

const words = strings.editor.rows;

export interface RowsProps<Row> {
  rows: readonly Row[];
  write(rows: Row[]): void;
  add(): Row;
  addLabel: string;
  empty: string;
  label(row: Row, index: number): string;
  render(row: Row, index: number): ComponentChildren;
  sortable?: boolean;
}

export function Rows<Row>(props: RowsProps<Row>) {
  const { rows, write, label } = props;
  const swap = (index: number, other: number) => {
    const moved = rows[index];
    if (moved === undefined) return;
    write(rows.toSpliced(index, 1).toSpliced(other, 0, moved));
  };
  return (
    <div class="m2-rows">
      {rows.length === 0 && <p class="m2-note">{props.empty}</p>}
      {rows.map((row, index) => (
        <fieldset class="m2-row" key={index}>
          <legend>{label(row, index)}</legend>
          <div class="m2-row-buttons">
            {props.sortable && (
              <>
                <RowButton
                  label={fill(words.up, { row: label(row, index) })}
                  text="↑"
                  disabled={index === 0}
                  act={() => swap(index, index - 1)}
                />
                <RowButton
                  label={fill(words.down, { row: label(row, index) })}
                  text="↓"
                  disabled={index === rows.length - 1}
                  act={() => swap(index, index + 1)}
                />
              </>
            )}
            <RowButton
              label={fill(words.remove, { row: label(row, index) })}
              text="×"
              act={() => write(rows.toSpliced(index, 1))}
            />
          </div>
          {props.render(row, index)}
        </fieldset>
      ))}
      <button type="button" class="m2-button" onClick={() => write([...rows, props.add()])}>
        {props.addLabel}
      </button>
    </div>
  );
}

interface RowButtonProps {
  label: string;
  text: string;
  disabled?: boolean;
  act(): void;
}

function RowButton({ label, text, disabled, act }: RowButtonProps) {
  return (
    <button
      type="button"
      class="m2-icon-button"
      title={label}
      aria-label={label}
      disabled={disabled}
      onClick={act}
    >
      {text}
    </button>
  );
}
