// Which keys are free for shortcuts.

/** Whether keys go into a text, a list or a slider now. */
export function isTyping(focused: globalThis.Element | null): boolean {
  if (!focused) return false;
  if (focused instanceof HTMLInputElement) return !/^(button|checkbox|radio)$/.test(focused.type);
  return (
    focused instanceof HTMLTextAreaElement ||
    focused instanceof HTMLSelectElement ||
    (focused instanceof HTMLElement && focused.isContentEditable)
  );
}
