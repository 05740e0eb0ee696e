// A value that may be an expression: one that is gets what may come next, and what its names are.
import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { isExpression } from "../../session/quantities";
import { ExpressionField, type ExpressionFieldProps } from "./ExpressionField";

export interface ValueFieldProps extends ExpressionFieldProps {
  /** The field of a value that is no expression. */
  children: ComponentChildren;
}

export function ValueField({ children, ...field }: ValueFieldProps) {
  const host = useRef<HTMLDivElement>(null);
  const [isCode, setIsCode] = useState(isExpression(field.value));
  const look = () => setIsCode(isExpression(field.value));
  useEffect(() => {
    // The field stays the same one while it has the focus.
    if (!host.current!.contains(document.activeElement)) look();
  }, [field.value]);
  return (
    <div ref={host} onFocusOut={() => setTimeout(look)}>
      {isCode ? <ExpressionField rows={1} {...field} /> : children}
    </div>
  );
}
