// The frame around every page: where one is, who one is, what moves, and how to stop it.
import { render } from "preact";
import { lazy, Suspense } from "preact/compat";
import { Header } from "./shared/Header";
import { route } from "./shared/router";
import { strings } from "./strings";
import "./theme.css";

const Home = lazy(() => import("./home/Home"));
const Editor = lazy(() => import("./editor/Editor"));
const Operate = lazy(() => import("./operate/Operate"));

function Page() {
  const at = route.value;
  switch (at.page) {
    case "home":
      return <Home />;
    case "editor":
      return <Editor key={at.mission} mission={at.mission} />;
    case "run":
      return <Operate key={at.run} source={{ kind: "run", run: at.run }} />;
    case "rehearsal":
      return <Operate key={at.id} source={{ kind: "rehearsal", id: at.id }} />;
    default:
      return <p>{strings.home.nothing}</p>;
  }
}

function App() {
  return (
    <>
      <Header />
      <main id="main">
        <Suspense fallback={null}>
          <Page />
        </Suspense>
      </main>
    </>
  );
}

render(<App />, document.getElementById("page")!);
