// To go to any moment of what was recorded: play at a speed, step, or take a position.
import { useEffect } from "preact/hooks";
import { clockTenths } from "../../shared/format";
import { fill, strings } from "../../strings";
import { Icon } from "../layout/icons";
import { isTyping } from "../layout/keys";
import { FASTEST, SLOWEST, type ReplayScene } from "../scene/replayScene";
import { keepPosition } from "./address";
import "./player.css";

const text = strings.operate.replay;

const MARKS = [0.25, 0.5, 1, 2, 5, 10, 25, 50, 100];

/** The slider goes by doublings. */
const toSlider = (speed: number): number => Math.log2(speed);
const ofSlider = (value: number): number => {
  const exact = 2 ** value;
  const near = MARKS.find((mark) => Math.abs(Math.log2(mark / exact)) < 0.12);
  return near ?? Number(exact.toPrecision(2));
};

export interface PlayerProps {
  scene: ReplayScene;
  /** It is a part of another page, whose keys and address mean other things. */
  embedded?: boolean;
}

export function Player({ scene, embedded = false }: PlayerProps) {
  const playing = scene.playing.value;
  const time = scene.time.value;
  const end = scene.end.value;
  const speed = scene.speed.value;

  useEffect(() => {
    if (embedded) return undefined;
    const press = (event: KeyboardEvent) => {
      if (event.ctrlKey || event.altKey || event.metaKey || isTyping(document.activeElement))
        return;
      if (event.key === "," || event.key === ".") scene.step(event.key === "." ? 1 : -1);
      else if (event.key === "k") turn(scene);
      else return;
      event.preventDefault();
    };
    addEventListener("keydown", press);
    return () => removeEventListener("keydown", press);
  }, [scene, embedded]);

  // Where it rests, not each moment that passes.
  useEffect(() => {
    if (playing || embedded) return;
    const timer = setTimeout(() => keepPosition(time), 400);
    return () => clearTimeout(timer);
  }, [playing, time]);

  return (
    <section class="player" aria-label={text.label} aria-busy={scene.loading.value}>
      <button type="button" class="plain" aria-label={text.start} onClick={() => scene.seek(0)}>
        <Icon name="start" />
      </button>
      <button
        type="button"
        class="plain"
        aria-label={text.back}
        title={`${text.back} (,)`}
        aria-keyshortcuts=","
        onClick={() => scene.step(-1)}
      >
        <Icon name="back" />
      </button>
      <button
        type="button"
        class="primary player-play"
        title={`${playing ? text.pause : text.play} (k)`}
        aria-keyshortcuts="k"
        onClick={() => turn(scene)}
      >
        <Icon name={playing ? "pause" : "play"} />
        {playing ? text.pause : text.play}
      </button>
      <button
        type="button"
        class="plain"
        aria-label={text.forward}
        title={`${text.forward} (.)`}
        aria-keyshortcuts="."
        onClick={() => scene.step(1)}
      >
        <Icon name="forward" />
      </button>
      <button type="button" class="plain" aria-label={text.end} onClick={() => scene.seek(end)}>
        <Icon name="end" />
      </button>
      <output class="player-time">
        {clockTenths(time)} {text.of} {clockTenths(end)}
      </output>
      {scene.loading.value && (
        <span class="player-reading" role="status">
          {text.reading}
        </span>
      )}
      {scene.problem.value && (
        <span class="player-problem" role="alert">
          {fill(text.failed, { problem: scene.problem.value })}
        </span>
      )}
      <input
        class="player-position"
        type="range"
        min={0}
        max={end}
        step="any"
        value={time}
        aria-label={text.position}
        aria-valuetext={clockTenths(time)}
        onInput={(event) => scene.seek(Number(event.currentTarget.value))}
        onKeyDown={(event) => {
          const by = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key];
          if (by === undefined) return;
          event.preventDefault();
          scene.seek(scene.now() + (by * Math.max(10, end)) / 100);
        }}
      />
      <label class="player-speed">
        <span>
          {text.speed} <b>{speed}×</b>
        </span>
        <input
          type="range"
          min={toSlider(SLOWEST)}
          max={toSlider(FASTEST)}
          step={0.05}
          value={toSlider(speed)}
          aria-valuetext={`${speed}×`}
          onInput={(event) => {
            scene.speed.value = ofSlider(Number(event.currentTarget.value));
          }}
        />
      </label>
    </section>
  );
}

function turn(scene: ReplayScene): void {
  if (scene.playing.value) scene.pause();
  else scene.play();
}
