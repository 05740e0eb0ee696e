// Pictures and files that leave the page.
export function download(name: string, content: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

export function bpmnFile(xml: string): Blob {
  return new Blob([xml], { type: "application/bpmn+xml" });
}

export function svgFile(svg: string): Blob {
  return new Blob([onWhite(svg)], { type: "image/svg+xml" });
}

/** Twice as many dots as the diagram has, for print. */
const SCALE = 2;

export async function pngFile(svg: string): Promise<Blob> {
  const address = URL.createObjectURL(svgFile(svg));
  try {
    const image = new Image();
    image.src = address;
    await image.decode();
    const canvas = document.createElement("canvas");
    canvas.width = image.width * SCALE;
    canvas.height = image.height * SCALE;
    canvas.getContext("2d")!.drawImage(image, 0, 0, canvas.width, canvas.height);
    return await new Promise((resolve, reject) =>
      canvas.toBlob((made) => (made ? resolve(made) : reject(new Error("too large"))), "image/png"),
    );
  } finally {
    URL.revokeObjectURL(address);
  }
}

function onWhite(svg: string): string {
  return svg.replace(
    /(<svg [^>]*viewBox="([^" ]+) ([^" ]+) ([^" ]+) ([^" ]+)"[^>]*>)/,
    (_, tag, ...box) => {
      const [x, y, width, height] = box as string[];
      return `${tag}<rect x="${x}" y="${y}" width="${width}" height="${height}" fill="white"/>`;
    },
  );
}
