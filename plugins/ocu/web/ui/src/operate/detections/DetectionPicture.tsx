// What a camera saw when something was detected, or why there is no picture of it.
import { useEffect, useState } from "preact/hooks";
import { getFile } from "../../shared/api";
import { fixed } from "../../shared/format";
import type { Detection } from "../../shared/types";
import { fill, strings } from "../../strings";
import { useOperating } from "../context";

const text = strings.operate.detections;

/** `onEnlarge`: it is shown larger, or as large as before. */
export function DetectionPicture({ of, onEnlarge }: { of: Detection; onEnlarge: () => void }) {
  const { scene } = useOperating();
  const { camera = "", picture, picture_after_s = 0, no_picture = "" } = of;
  const { address, failed } = usePicture(scene.run, picture);
  if (!camera) return null;
  if (no_picture) return <p class="hint">{fill(text.noPicture, { why: no_picture })}</p>;
  if (picture === undefined) {
    const why = scene.mode === "live" ? text.pictureComes : text.pictureLost;
    return <p class="hint">{fill(why, { camera })}</p>;
  }
  if (failed) return <p class="hint">{fill(text.pictureFailed, { why: failed })}</p>;
  return (
    <figure class="detection-picture">
      <button type="button" class="plain" title={text.enlarge} onClick={onEnlarge}>
        {address ? (
          <img src={address} alt={fill(text.pictureOf, { camera, type: of.type })} />
        ) : (
          strings.shell.loading
        )}
      </button>
      <figcaption>
        {fill(text.pictureBy, { camera, seconds: fixed(picture_after_s, 1) })}
      </figcaption>
    </figure>
  );
}

/** An image cannot send the key of the session: the page fetches it. */
function usePicture(
  run: string,
  picture: number | undefined,
): { address: string; failed: string } {
  const [shown, show] = useState({ address: "", failed: "" });
  useEffect(() => {
    show({ address: "", failed: "" });
    if (picture === undefined) return;
    let left = false;
    let address = "";
    getFile(`/runs/${encodeURIComponent(run)}/detections/${picture}/picture`).then(
      (content) => {
        if (left) return;
        address = URL.createObjectURL(content);
        show({ address, failed: "" });
      },
      (error: unknown) => {
        if (left) return;
        show({ address: "", failed: error instanceof Error ? error.message : String(error) });
      },
    );
    return () => {
      left = true;
      if (address) URL.revokeObjectURL(address);
    };
  }, [run, picture]);
  return shown;
}
