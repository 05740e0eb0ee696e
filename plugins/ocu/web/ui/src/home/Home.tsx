// The first page: what starts later, which missions there are, and what is and was run.
import { MissionList } from "./MissionList";
import { RunList } from "./RunList";
import { ScheduleList } from "./ScheduleList";
import "./home.css";

export default function Home() {
  return (
    <div class="home">
      <ScheduleList />
      <MissionList />
      <RunList />
    </div>
  );
}
