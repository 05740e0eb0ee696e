export default function Home() {
  return <h1>Missions</h1>;
}
