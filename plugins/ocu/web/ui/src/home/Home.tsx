// The first page: which missions there are, and what is and was run.
import { MissionList } from "./MissionList";
import { RunList } from "./RunList";
import "./home.css";

export default function Home() {
  return (
    <div class="home">
      <MissionList />
      <RunList />
    </div>
  );
}
