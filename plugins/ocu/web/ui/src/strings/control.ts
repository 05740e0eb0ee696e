// Texts of the blocks for the course of a mission: what comes when, and what happens otherwise.
import { OPEN_PLACES } from "./openPlaces";

export const control = {
  group: "Course of the mission",
  /** What still has to be chosen begins with this: the next block takes its place. */
  open: OPEN_PLACES.en,
  names: {
    first: "Choose what is done first",
    also: "Choose what is done at the same time",
    body: "Choose what is done",
    then: "Choose what is done then",
    instead: "Choose what is done instead",
    fork: "At the same time",
    join: "Both are done",
    wait: "Wait {duration}",
    until: "Wait until {date}",
    ready: "Wait until it is so",
    signal: "Go on",
    stopSignal: "Stop it",
    decide: "Is it so?",
    yes: "Yes",
    no: "No",
    repeat: "Repeat {count} times",
    every: "Every {duration}, {count} times",
    begin: "Begin",
    done: "Done",
    watch: "Until something is detected",
    both: "Do and watch",
    detect: "Watch",
    detected: "Detected",
    ask: "Ask the operator",
    question: "Go on?",
    answer: "Answer?",
    go: "Continue",
    abort: "Abort",
    failed: "It failed",
    late: "After {duration}",
    askAgain: "Ask: it failed. Try again?",
    again: "Try again?",
    tryAgain: "Try again",
    giveUp: "Give up",
    call: "Call another mission",
  },
  blocks: {
    same: {
      title: "At the same time",
      doc: "Two things begin together; the mission goes on when both are done.",
    },
    wait: { title: "Wait", doc: "The mission goes on after a time." },
    waitFor: { title: "Wait {duration}", doc: "The mission goes on after a time." },
    until: { title: "Wait until a time", doc: "The mission goes on at a date and time of the clock." },
    ready: {
      title: "Wait until something is true",
      doc: "The mission goes on as soon as a condition on its data is true.",
    },
    signal: {
      title: "When a signal comes, go on",
      doc: "The mission waits for a signal of an operator, or of another mission.",
    },
    stopSignal: {
      title: "When an operator says so, stop",
      doc: "What is selected is stopped when a signal comes; then something else is done.",
    },
    if: { title: "If", doc: "Something is done only if a condition is true." },
    repeat: { title: "Repeat", doc: "Something is done again and again, so many times." },
    repeatFor: {
      title: "Repeat {count} times",
      doc: "Something is done again and again, so many times.",
    },
    every: {
      title: "Every so often",
      doc: "Something is done, then a time passes, again and again, so many times.",
    },
    everyFor: {
      title: "Every {duration}",
      doc: "Something is done, then a time passes, again and again, so many times.",
    },
    detected: {
      title: "When something is detected, stop",
      doc: "Something is done while a detector watches. When it finds something, that is stopped and something else is done.",
    },
    ask: {
      title: "Ask and decide",
      doc: "A question to the operators; the mission goes on, or is aborted, by the answer.",
    },
    fails: {
      title: "If it fails",
      doc: "When what is selected fails, something else is done, and the mission goes on.",
    },
    retry: {
      title: "Try again",
      doc: "When something fails, the operators say whether it is tried again.",
    },
    within: {
      title: "Within a time",
      doc: "What is selected is stopped when it takes too long; then something else is done.",
    },
    withinFor: {
      title: "Within {duration}",
      doc: "What is selected is stopped when it takes too long; then something else is done.",
    },
    call: {
      title: "Call another mission",
      doc: "Another process is done from its beginning to its end; then this one goes on.",
    },
  },
} as const;
