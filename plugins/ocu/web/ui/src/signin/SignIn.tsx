// Where named operators sign in; on the executive's own machine its address does that.
import { useState } from "preact/hooks";
import { ApiError } from "../shared/api";
import { connect } from "../shared/executive";
import { go } from "../shared/router";
import { nextPath, signIn, type Refused } from "../shared/session";
import { strings } from "../strings";
import "./signin.css";

const text = strings.signIn;

export default function SignIn() {
  const [name, setName] = useState("");
  const [password, setPassword] = useState("");
  const [problem, setProblem] = useState(refused());
  const [busy, setBusy] = useState(false);

  async function submit(event: Event): Promise<void> {
    event.preventDefault();
    setBusy(true);
    setProblem("");
    try {
      await signIn(name, password);
      connect();
      go(nextPath(location.search));
    } catch (error) {
      setProblem(problemOf(error));
      setPassword("");
    } finally {
      setBusy(false);
    }
  }

  return (
    <div class="sign-in">
      <form onSubmit={(event) => void submit(event)}>
        <h1>{text.title}</h1>
        <label>
          {text.name}
          <input
            name="username"
            autocomplete="username"
            required
            autofocus
            value={name}
            onInput={(event) => setName(event.currentTarget.value)}
          />
        </label>
        <label>
          {text.password}
          <input
            type="password"
            name="password"
            autocomplete="current-password"
            required
            value={password}
            onInput={(event) => setPassword(event.currentTarget.value)}
          />
        </label>
        <p role="alert" class="problem">
          {problem}
        </p>
        <button class="primary" disabled={busy}>
          {text.submit}
        </button>
        <p class="hint">
          {text.hint} <code>{text.command}</code>
        </p>
      </form>
    </div>
  );
}

/** Why one was sent here. */
function refused(): string {
  const why = new URLSearchParams(location.search).get("refused");
  return why === null ? "" : (text.refused[why as Refused] ?? "");
}

function problemOf(error: unknown): string {
  if (!(error instanceof ApiError)) return text.unreachable;
  return error.status === 401 ? text.wrong : error.message;
}
