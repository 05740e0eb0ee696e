// What can be done with the mission as a whole.
import { useRef } from "preact/hooks";
import { revising } from "../../revise/revising";
import { activeRuns } from "../../shared/executive";
import { Menu, type MenuItem } from "../../shared/Menu";
import { go } from "../../shared/router";
import { titleOf } from "../../shared/runs";
import { may } from "../../shared/session";
import { toast } from "../../shared/Toasts";
import { fill, strings } from "../../strings";
import type { MissionWork } from "../session/MissionWork";
import { bpmnFile, download, pngFile, svgFile } from "../session/pictures";
import { Icon, IconButton } from "./icons";

const words = strings.editor.toolbar;

export interface ToolbarProps {
  work: MissionWork;
  showsBlocks: boolean;
  toggleBlocks(): void;
  showsPanel: boolean;
  togglePanel(): void;
}

export function Toolbar(props: ToolbarProps) {
  const { work } = props;
  const { session } = work;
  const isDirty = session.isDirty.value;
  const actions = () => session.service("editorActions");
  const zoom = (value: number) => actions().trigger("stepZoom", { value } as never);
  return (
    <div class="m2-toolbar" role="toolbar" aria-label={words.label}>
      <IconButton icon="back" label={words.back} act={() => go("/")} />
      <h1 class="m2-title">{work.mission}</h1>
      <span class="m2-editing">{strings.editor.editing}</span>
      <span class="m2-saved-state" role="status">
        {isDirty ? strings.editor.unsaved : strings.editor.saved}
      </span>
      {may("commander") && (
        <button
          type="button"
          class={isDirty ? "primary" : "secondary"}
          title={words.saveHint}
          disabled={!isDirty || work.isSaving.value}
          onClick={() => void work.save()}
        >
          {words.save}
        </button>
      )}
      <span class="m2-gap" />
      <IconButton
        icon="undo"
        label={words.undo}
        disabled={!session.canUndo.value}
        act={() => session.service("commandStack").undo()}
      />
      <IconButton
        icon="redo"
        label={words.redo}
        disabled={!session.canRedo.value}
        act={() => session.service("commandStack").redo()}
      />
      <span class="m2-gap" />
      <IconButton
        icon="search"
        label={words.search}
        act={() => actions().trigger("find", {} as never)}
      />
      <IconButton icon="minus" label={words.zoomOut} act={() => zoom(-1)} />
      <IconButton icon="plus" label={words.zoomIn} act={() => zoom(1)} />
      <IconButton icon="fit" label={words.fit} act={() => session.fit()} />
      <IconButton
        icon="map"
        label={words.minimap}
        act={() => session.service("minimap").toggle()}
      />
      <IconButton
        icon="layout"
        label={words.layout}
        act={() => (work.question.value = { kind: "layout" })}
      />
      <span class="m2-stretch" />
      <button
        type="button"
        class="plain m2-map-button"
        aria-pressed={session.plan.isShown.value}
        onClick={() => session.plan.show(!session.plan.isShown.value)}
      >
        <Icon name="place" />
        {strings.plan.toggle}
      </button>
      <IconButton
        icon="blocks"
        label={words.blocks}
        pressed={props.showsBlocks}
        act={props.toggleBlocks}
      />
      <IconButton
        icon="panel"
        label={words.panel}
        pressed={props.showsPanel}
        act={props.togglePanel}
      />
      <FileMenu work={work} />
    </div>
  );
}

function FileMenu({ work }: { work: MissionWork }) {
  const file = useRef<HTMLInputElement>(null);
  const texts = strings.editor.file;
  const { session, mission } = work;
  const picture = async () => {
    const { svg } = await session.modeler.saveSVG();
    return svg;
  };
  const png = async () => {
    try {
      download(`${mission}.png`, await pngFile(await picture()));
    } catch {
      toast(texts.pngFailed, "bad");
    }
  };
  const ask = (kind: "versions" | "saveAs" | "shortcuts") => () => {
    work.question.value = { kind };
  };
  const items: MenuItem[] = [
    ...(may("commander") ? [{ label: texts.saveAs, act: ask("saveAs") }] : []),
    { label: texts.versions, act: ask("versions") },
    {
      label: strings.compare.open,
      act: () => void work.compare(),
    },
    ...(may("commander") ? activeRuns.value : [])
      .filter((run) => titleOf(run) === mission)
      .map(({ run }) => ({
        label: fill(strings.revise.giveTo, { run }),
        act: () => void giveTo(work, run),
      })),
    { label: texts.upload, act: () => file.current?.click() },
    {
      label: texts.download,
      act: () => void session.xml().then((xml) => download(`${mission}.bpmn`, bpmnFile(xml))),
    },
    {
      label: texts.svg,
      act: () => void picture().then((svg) => download(`${mission}.svg`, svgFile(svg))),
    },
    { label: texts.png, act: () => void png() },
    { label: texts.shortcuts, act: ask("shortcuts") },
  ];
  const chosen = async (input: HTMLInputElement) => {
    const [first] = input.files ?? [];
    input.value = "";
    if (first) await work.replaceBy(first.name, await first.text());
  };
  return (
    <>
      <Menu label={words.more} items={items} class="plain">
        <Icon name="more" />
      </Menu>
      <input
        ref={file}
        type="file"
        accept=".bpmn,.bpmn2,.xml"
        hidden
        aria-label={texts.upload}
        onChange={(event) => void chosen(event.currentTarget)}
      />
    </>
  );
}

/** The run shows what it would do to go on with what is drawn here, which is saved before. */
async function giveTo(work: MissionWork, run: string): Promise<void> {
  if (!(await work.save())) return;
  go(`/runs/${encodeURIComponent(run)}`);
  revising.value = { run, version: { kind: "mission", mission: work.mission, version: "" } };
}
