// The card of the task's result: a picture of the organ with what it hid, and the score, as a PNG file to share.
import { save } from "./path_files";
import { word } from "./words";

const WIDTH = 1200, HEIGHT = 630, EDGE = 40, PICTURE = 640, LINE = 38; // px

export function noduleCard(picture: HTMLCanvasElement, result: string) {
  const card = Object.assign(document.createElement("canvas"), { width: WIDTH, height: HEIGHT }), pen = card.getContext("2d")!;
  const style = getComputedStyle(document.body), colour = (name: string) => style.getPropertyValue(name);
  pen.fillStyle = colour("--panel");
  pen.fillRect(0, 0, WIDTH, HEIGHT);
  const scale = Math.min(PICTURE / picture.width, (HEIGHT - 2 * EDGE) / picture.height), [wide, high] = [scale * picture.width, scale * picture.height];
  pen.drawImage(picture, (PICTURE - wide) / 2, (HEIGHT - high) / 2, wide, high);
  const x = PICTURE + EDGE, width = WIDTH - PICTURE - 2 * EDGE;
  const write = (text: string, font: string, name: string, from: number) => {
    pen.font = `${font} system-ui, sans-serif`;
    pen.fillStyle = colour(name);
    return linesOf(text, width, pen).reduce((y, line) => (pen.fillText(line, x, y), y + LINE), from);
  };
  let y = write(word("task.name"), "600 34px", "--ink", 90) + 16;
  y = write(result, "26px", "--ink", y) + 16;
  write(word("page.purpose"), "20px", "--soft", Math.max(y, HEIGHT - 130));
  card.toBlob((png) => png && save("nodule.png", png));
}

function linesOf(text: string, width: number, pen: CanvasRenderingContext2D): string[] {
  const lines = [""];
  for (const part of text.split(" ")) {
    const longer = `${lines.at(-1)} ${part}`.trim();
    if (pen.measureText(longer).width > width && lines.at(-1)) lines.push(part);
    else lines[lines.length - 1] = longer;
  }
  return lines;
}
