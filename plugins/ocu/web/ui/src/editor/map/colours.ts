// A colour for each vehicle: apart for the colour-blind (Okabe and Ito, darkened), and with white
// letters on it in every theme (4.5 : 1 at least).
const COLOURS = ["#0a5ca8", "#a34700", "#00704f", "#93366f", "#6b5b00", "#4f46a5", "#8c2d19", "#2f6072"];
/** Of what is chosen when the task starts, and of teams. */
const OTHERS = "#4a5560";

export function colourOf(vehicles: readonly { id: string }[], who: string): string {
  const [vehicle = ""] = who.split("/");
  const at = vehicles.findIndex(({ id }) => id === vehicle);
  return at < 0 ? OTHERS : COLOURS[at % COLOURS.length]!;
}
