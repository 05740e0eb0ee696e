// What people search for when they mean the course of a mission: "in parallel", "in 5 minutes".
import { durationIn } from "../../session/durations";
import type { FragmentKind, Options } from "./fragments";

export interface Intent {
  kind: FragmentKind;
  options: Options;
}

const PHRASES: Record<FragmentKind, readonly string[]> = {
  same: [
    "at the same time",
    "in parallel",
    "parallel",
    "simultaneously",
    "simultaneous",
    "both",
    "both together",
    "concurrently",
    "concurrent",
    "meanwhile",
    "fork",
    "side by side",
    "split in two",
    "while the other",
  ],
  wait: ["wait", "wait for a time", "pause", "delay", "sleep", "later", "timer", "hold on"],
  until: ["wait until a time", "at a time", "at a date", "at noon", "tomorrow", "clock", "schedule"],
  ready: [
    "wait until something is true",
    "wait for a condition",
    "as soon as",
    "until ready",
    "when it is true",
  ],
  signal: [
    "when a signal comes go on",
    "wait for a signal",
    "wait for an operator",
    "wait for a message",
    "until an operator says",
    "go ahead",
    "synchronize",
    "signal comes",
  ],
  stopSignal: [
    "when an operator says so stop",
    "interrupt",
    "interrupt by operator",
    "cancel",
    "abort by signal",
    "stop by signal",
    "stop when an operator says",
    "call it off",
    "recall",
  ],
  if: ["if", "if else", "otherwise", "depending on", "only when", "branch", "condition", "choose way"],
  repeat: ["repeat", "loop", "times", "again and again", "several times", "for each", "iterate", "rounds"],
  every: ["every", "every so often", "periodically", "regularly", "each", "at intervals"],
  detected: [
    "when something is detected stop",
    "when detected",
    "until detected",
    "stop when something is found",
    "stop when detected",
    "stop when",
    "detect",
    "detection",
    "found something",
    "watch for",
    "look out for",
    "search until",
  ],
  ask: [
    "ask",
    "ask the operator",
    "ask and decide",
    "question",
    "let the operator decide",
    "decision",
    "confirm",
    "approve",
    "yes or no",
  ],
  fails: [
    "if it fails",
    "on failure",
    "on error",
    "when it fails",
    "error",
    "failure",
    "fallback",
    "goes wrong",
    "catch",
    "handle error",
    "except",
  ],
  retry: ["try again", "retry", "repeat until it works", "once more", "second attempt", "retries"],
  within: [
    "within a time",
    "within",
    "timeout",
    "time out",
    "time limit",
    "deadline",
    "at most",
    "takes too long",
    "no longer than",
    "give up after",
  ],
  call: [
    "call another mission",
    "call",
    "submission",
    "sub mission",
    "other mission",
    "include mission",
    "run another mission",
    "reuse",
  ],
};

/** With a duration, these words alone say what is meant. */
const TIMED: readonly [FragmentKind, RegExp][] = [
  ["every", /^(every|each|repeat every|periodically)?$/],
  ["within", /^(within|timeout|time out|time limit|at most|max|no longer than|limit|deadline)$/],
  ["within", /^(stop|give up|abort|cancel) (after|if longer than)$/],
  ["wait", /^(in|after|for|wait|wait for|pause|pause for|delay|sleep|hold for|later|then)?$/],
];

const COUNTS: Record<string, number> = { once: 1, twice: 2, thrice: 3 };
const COUNT = /\b(\d+)\s*(?:x|times|rounds)\b/;
const STOP_WORDS = new Set(["a", "an", "the", "it", "of", "to", "so", "is", "and", "i", "please"]);

const FEWEST_LETTERS = 2;
/** So much of a long phrase must be known; the rest may be what it is about. */
const KNOWN_PART = 0.6;

/** What a search may mean, the most likely first; none: it is a plain search. */
export function intentsOf(search: string): Intent[] {
  const said = search.toLowerCase().replace(/[^\p{L}\p{N}.]+/gu, " ").trim();
  const [without, options] = optionsIn(said);
  const found = new Map<FragmentKind, number>();
  if (options.duration) {
    for (const [kind, pattern] of TIMED) {
      if (pattern.test(without) && !(kind === "every" && without === "")) found.set(kind, 10);
    }
  }
  if (options.count && /^(repeat|loop|do|again)?$/.test(without)) found.set("repeat", 10);
  const typed = wordsOf(without);
  if (typed.join("").length >= FEWEST_LETTERS) {
    for (const [kind, phrases] of Object.entries(PHRASES) as [FragmentKind, string[]][]) {
      const score = Math.max(...phrases.map((phrase) => likeness(typed, wordsOf(phrase))));
      if (score > 0) found.set(kind, Math.max(score, found.get(kind) ?? 0));
    }
  }
  const ranked = [...found].sort(([, one], [, other]) => other - one);
  return ranked.map(([kind]) => ({ kind, options }));
}

function optionsIn(said: string): [without: string, options: Options] {
  const options: Options = {};
  let without = said;
  const duration = durationIn(said);
  if (duration) {
    options.duration = duration.iso;
    without = without.replace(duration.text, " ");
  }
  const [counted, number] = COUNT.exec(without) ?? [];
  const word = Object.keys(COUNTS).find((each) => new RegExp(`\\b${each}$`).test(without));
  if (counted) options.count = Number(number);
  else if (word && word !== "once") options.count = COUNTS[word]!;
  if (options.count) without = without.replace(counted ?? word!, " ");
  return [without.replace(/\s+/g, " ").trim(), options];
}

function wordsOf(text: string): string[] {
  return text.split(/\s+/).filter((word) => word && !STOP_WORDS.has(word));
}

/** 0: they have nothing in common. Words may be typed in part. */
function likeness(typed: readonly string[], phrase: readonly string[]): number {
  if (typed.join(" ") === phrase.join(" ")) return 5;
  const known = typed.filter((word) => phrase.some((each) => each.startsWith(word)));
  const covered = phrase.filter((each) => typed.some((word) => each.startsWith(word)));
  if (known.length === typed.length) {
    const begins = phrase.join(" ").startsWith(typed.join(" "));
    return (begins ? 3 : 2) + covered.length / phrase.length;
  }
  const isLong = typed.length > 2 && covered.length > 1;
  if (!isLong || known.length / typed.length < KNOWN_PART) return 0;
  return known.length / typed.length + covered.length / phrase.length / 2;
}
