/** Frames that the graph shows. */
const FRAMES = 240;

/** A graph over the last frames: triangles that are drawn, those in the frustum, and bytes that were fetched. */
export class Graph {
  private readonly drawn = new Float32Array(FRAMES);
  private readonly frustum = new Float32Array(FRAMES);
  private readonly bytes = new Float32Array(FRAMES);
  private next = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  add(drawn: number, frustum: number, bytes: number): void {
    this.drawn[this.next] = drawn;
    this.frustum[this.next] = frustum;
    this.bytes[this.next] = bytes;
    this.next = (this.next + 1) % FRAMES;
  }

  /** `whole`: bytes of the whole model; 0: it is not fetched in parts. */
  draw(whole: number): void {
    const { canvas } = this;
    const ratio = window.devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== width * ratio || canvas.height !== height * ratio) Object.assign(canvas, { width: width * ratio, height: height * ratio });
    const pen = canvas.getContext('2d')!;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const last = (this.next + FRAMES - 1) % FRAMES;
    const most = Math.max(1, ...this.frustum, ...this.drawn);
    this.line(pen, this.frustum, most, '#9aa7b4', width, height);
    this.line(pen, this.drawn, most, '#c0392b', width, height);
    if (whole > 0) this.line(pen, this.bytes, whole, '#2f6fb0', width, height);
    pen.font = '11px system-ui, sans-serif';
    const text = (words: string, colour: string, y: number): void => {
      pen.fillStyle = colour;
      pen.fillText(words, 8, y);
    };
    text(`${number(this.frustum[last]!)} triangles in the frustum`, '#5f6b77', 15);
    text(`${number(this.drawn[last]!)} drawn`, '#c0392b', 29);
    if (whole > 0) text(`${megabytes(this.bytes[last]!)} of ${megabytes(whole)} fetched`, '#2f6fb0', 43);
  }

  private line(pen: CanvasRenderingContext2D, values: Float32Array, most: number, colour: string, width: number, height: number): void {
    pen.beginPath();
    for (let i = 0; i < FRAMES; i++) pen.lineTo((i / (FRAMES - 1)) * width, height - 4 - (values[(this.next + i) % FRAMES]! / most) * (height - 56));
    pen.strokeStyle = colour;
    pen.lineWidth = 1.5;
    pen.stroke();
  }
}

export function number(count: number): string {
  return Math.round(count).toLocaleString('en');
}

export function megabytes(bytes: number): string {
  return `${(bytes / 1e6).toFixed(bytes < 1e7 ? 2 : 0)} MB`;
}
