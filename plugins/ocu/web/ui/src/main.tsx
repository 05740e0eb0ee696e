// The frame around every page: where one is, who one is, what moves, and how to stop it.
import { signal } from "@preact/signals";
import { render } from "preact";
import { useEffect } from "preact/hooks";
import { followAlerts } from "./alerts/alerts";
import { keepShell } from "./offline/keepShell";
import { followLastKnown } from "./offline/lastKnown";
import { NoConnection } from "./offline/NoConnection";
import { connect } from "./shared/executive";
import { Header } from "./shared/Header";
import { loaded } from "./shared/loaded";
import { route } from "./shared/router";
import { loadSession, redeem, session, takeToken, toSignIn } from "./shared/session";
import { followStandbys } from "./shared/standbys";
import { Toasts } from "./shared/Toasts";
import { strings } from "./strings";
import "./theme.css";
import "./contrast.css";
import "./controls.css";
import "./forced.css";

const Home = loaded(() => import("./home/Home"));
const Alerts = loaded(() => import("./alerts/AlertPage"));
const Fleet = loaded(() => import("./fleet/Fleet"));
const Editor = loaded(() => import("./editor/Editor"));
const Operate = loaded(() => import("./operate/Operate"));
const SignIn = loaded(() => import("./signin/SignIn"));

function Page() {
  const at = route.value;
  switch (at.page) {
    case "home":
      return <Home />;
    case "alerts":
      return <Alerts />;
    case "signIn":
      return <SignIn />;
    case "fleet":
      return <Fleet />;
    case "editor":
      return <Editor key={at.mission} mission={at.mission} />;
    case "run":
      return <Operate key={at.run} source={{ kind: "run", run: at.run }} />;
    case "rehearsal":
      return <Operate key={at.id} source={{ kind: "rehearsal", id: at.id }} />;
    case "nothing":
      return <p class="nothing">{strings.home.nothing}</p>;
  }
}

/** false: the executive did not answer when it was asked last. */
const isAnswered = signal(true);

async function begin(token: string): Promise<void> {
  const answered = token ? await redeem(token) : await loadSession();
  isAnswered.value = answered;
  if (!answered) setTimeout(() => void begin(token), 2000);
  else if (session.value === null) toSignIn();
  else connect();
}

function App() {
  useEffect(() => void begin(takeToken()), []);
  const known = session.value !== undefined;
  const mayLook = session.value !== null || route.value.page === "signIn";
  return (
    <>
      <Header />
      <main id="main" tabIndex={-1}>
        {known && mayLook && <Page />}
        {!known && !isAnswered.value && <NoConnection />}
      </main>
      <div id="dialogs" />
      <Toasts />
    </>
  );
}

followStandbys();
followAlerts();
followLastKnown();
keepShell();
render(<App />, document.getElementById("page")!);
