// Figures that stand at places of the picture. at: px in the canvas; null: not shown.
export function showFigures(list: HTMLElement, figures: { text: string | null; at: [x: number, y: number] | null }[]) {
  while (list.children.length > figures.length) list.lastElementChild!.remove();
  figures.forEach(({ text, at }, f) => {
    const figure = (list.children[f] ?? list.appendChild(document.createElement("span"))) as HTMLElement;
    figure.hidden = !text || !at;
    if (!text || !at) return;
    figure.textContent = text;
    figure.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, 40%)`;
  });
}
