// On every page.
import { strings } from "../strings";

export function Header() {
  return (
    <header>
      <a href="/">{strings.shell.title}</a>
    </header>
  );
}
