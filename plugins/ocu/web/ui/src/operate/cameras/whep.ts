// WebRTC by WHEP (WebRTC-HTTP Egress Protocol, draft-ietf-wish-whep): one offer, one answer.
import { strings } from "../../strings";
import { videoIn, type Player } from "./player";

const text = strings.cameras;

/** Candidates that come later are not sent: a camera is in a network of few. */
const GATHERING_MS = 1500;

export const playWhep: Player = (host, { url }, listener) => {
  const element = videoIn(host, listener);
  const peer = new RTCPeerConnection();
  const leaving = new AbortController();
  let session = "";
  peer.addTransceiver("video", { direction: "recvonly" });
  peer.ontrack = ({ streams, track }) => {
    element.srcObject = streams[0] ?? new MediaStream([track]);
  };
  peer.onconnectionstatechange = () => {
    if (peer.connectionState === "failed") listener.failed(text.noPeer);
  };

  const begin = async () => {
    await peer.setLocalDescription(await peer.createOffer());
    await gathered(peer);
    const answer = await fetch(url, {
      method: "POST",
      mode: "cors",
      credentials: "omit",
      referrerPolicy: "no-referrer",
      headers: { "Content-Type": "application/sdp" },
      body: peer.localDescription!.sdp,
      signal: leaving.signal,
    });
    if (answer.status !== 201) {
      listener.failed(`${text.refused} ${answer.status}`);
      return;
    }
    session = sessionOf(answer, url);
    await peer.setRemoteDescription({ type: "answer", sdp: await answer.text() });
  };
  begin().catch((error: unknown) => {
    if (!leaving.signal.aborted) listener.failed(error instanceof TypeError ? text.noStream : text.noPeer);
  });
  return () => {
    leaving.abort();
    peer.close();
    // The session would hold the camera until it times out.
    if (session) {
      void fetch(session, { method: "DELETE", mode: "cors", credentials: "omit" }).catch(
        () => undefined,
      );
    }
  };
};

/** The resource of the session: of the same origin, else it is not used. */
function sessionOf(answer: Response, url: string): string {
  const location = answer.headers.get("location");
  if (!location) return "";
  const session = new URL(location, url);
  return session.origin === new URL(url).origin ? session.href : "";
}

function gathered(peer: RTCPeerConnection): Promise<void> {
  return new Promise((done) => {
    if (peer.iceGatheringState === "complete") {
      done();
      return;
    }
    const timer = setTimeout(done, GATHERING_MS);
    peer.addEventListener("icegatheringstatechange", () => {
      if (peer.iceGatheringState !== "complete") return;
      clearTimeout(timer);
      done();
    });
  });
}
