// What the fleet's cameras see now.
import { strings } from "../../strings";
import { useOperating } from "../context";
import { Pane } from "../layout/Pane";
import CameraList from "./CameraList";

export default function CamerasPane() {
  const { fleet } = useOperating();
  return (
    <Pane title={strings.operate.panes.cameras} class="cameras-pane" scrolls>
      <CameraList payloads={fleet.payloads} />
    </Pane>
  );
}
