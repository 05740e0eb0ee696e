// In place of what bpmn-js-properties-panel brings along and the editor never shows: editors of
// FEEL and JSON (vite.config.ts). They would be a third of the page.
export default class Nothing {
  /** Called when the package is loaded. */
  static define(): Nothing {
    return new Nothing();
  }
}

export {
  Nothing as FeelersEditor,
  Nothing as EditorView,
  Nothing as EditorState,
  Nothing as Annotation,
};

const nothing = (): Nothing[] => [];

export {
  nothing as bracketMatching,
  nothing as closeBrackets,
  nothing as closeBracketsKeymap,
  nothing as defaultHighlightStyle,
  nothing as defaultKeymap,
  nothing as drawSelection,
  nothing as foldGutter,
  nothing as foldKeymap,
  nothing as highlightSpecialChars,
  nothing as history,
  nothing as historyKeymap,
  nothing as json,
  nothing as jsonParseLinter,
  nothing as keymap,
  nothing as lineNumbers,
  nothing as linter,
  nothing as placeholder,
  nothing as syntaxHighlighting,
};
