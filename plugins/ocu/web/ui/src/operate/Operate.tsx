export default function Operate({ source }: { source: { kind: "run"; run: string } | { kind: "rehearsal"; id: string } }) {
  return <h1>{source.kind}</h1>;
}
