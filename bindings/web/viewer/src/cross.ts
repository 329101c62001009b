// The cross over the organ at which the keyboard and gamepads push.
export class Cross {
  private at = { x: 0.5, y: 0.5 }; // in the canvas's size

  constructor(private canvas: HTMLElement, private mark: HTMLElement) {}

  // Pixels of the canvas.
  get place(): [x: number, y: number] {
    return [this.at.x * this.canvas.clientWidth, this.at.y * this.canvas.clientHeight];
  }

  // By pixels; it stays on the canvas.
  move(right: number, down: number) {
    const { clientWidth: width, clientHeight: height } = this.canvas, inside = (share: number) => Math.max(0.02, Math.min(0.98, share));
    this.at = { x: inside(this.at.x + right / width), y: inside(this.at.y + down / height) };
    this.mark.style.left = `${100 * this.at.x}%`;
    this.mark.style.top = `${100 * this.at.y}%`;
  }

  show(on: boolean) {
    this.mark.hidden = !on;
  }
}
