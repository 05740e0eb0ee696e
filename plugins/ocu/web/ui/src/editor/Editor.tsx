export default function Editor({ mission }: { mission: string }) {
  return <h1>{mission}</h1>;
}
