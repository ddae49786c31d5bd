import { Vector3 } from 'three';
import type { Model } from './model.js';

/** Points along the longer side at which cells are looked up. */
const POINTS = 260;
/** Metres around the outermost doors and windows. */
const AROUND = 4;
/** The plan is made again when the eye has risen by this, metres. */
const RISE = 0.3;
const PORTALS = { door: '#c0562b', window: '#3f8ccf', opening: '#3a9a55' } as const;

interface Frame {
  readonly x: number;
  readonly z: number;
  /** Metres a point. */
  readonly step: number;
  readonly columns: number;
  readonly rows: number;
}

/** The plan at the height of the eye: cells, those that are seen, portals and the eye. */
export class Plan {
  private readonly frame: Frame;
  private height = NaN;
  private cells = new Int32Array(0);
  private readonly picture = document.createElement('canvas');
  private readonly portals: { corners: Float64Array; colour: string; low: number; high: number }[] = [];

  constructor(private readonly canvas: HTMLCanvasElement, private readonly model: Model) {
    const { building } = model;
    let [ax, az, bx, bz] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let number = 0; number < building.portals; number++) {
      const { corners, kind } = building.portal(number);
      let [low, high] = [Infinity, -Infinity];
      for (let at = 0; at < corners.length; at += 3) {
        [ax, bx] = [Math.min(ax, corners[at]!), Math.max(bx, corners[at]!)];
        [az, bz] = [Math.min(az, corners[at + 2]!), Math.max(bz, corners[at + 2]!)];
        [low, high] = [Math.min(low, corners[at + 1]!), Math.max(high, corners[at + 1]!)];
      }
      this.portals.push({ corners, colour: PORTALS[kind], low, high });
    }
    if (building.portals === 0) [ax, az, bx, bz] = [-10, -10, 10, 10];
    [ax, az, bx, bz] = [ax - AROUND, az - AROUND, bx + AROUND, bz + AROUND];
    const step = Math.max(bx - ax, bz - az) / POINTS;
    this.frame = { x: ax, z: az, step, columns: Math.ceil((bx - ax) / step), rows: Math.ceil((bz - az) / step) };
  }

  /** Draws the plan around an eye that looks along its yaw with so wide a picture, radians. */
  draw(eye: Vector3, yaw: number, wide: number): void {
    if (!(Math.abs(eye.y - this.height) < RISE)) this.lookUp(eye.y);
    const { canvas, picture } = this;
    const ratio = window.devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== width * ratio || canvas.height !== height * ratio) Object.assign(canvas, { width: width * ratio, height: height * ratio });
    this.paint();
    const pen = canvas.getContext('2d')!;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const scale = this.scale();
    pen.imageSmoothingEnabled = false;
    pen.drawImage(picture, ...this.place(this.frame.x, this.frame.z), picture.width * this.frame.step * scale, picture.height * this.frame.step * scale);
    for (const { corners, colour, low, high } of this.portals) {
      if (eye.y < low - 1 || eye.y > high + 1) continue;
      pen.beginPath();
      for (let at = 0; at < corners.length; at += 3) pen.lineTo(...this.place(corners[at]!, corners[at + 2]!));
      pen.closePath();
      pen.strokeStyle = colour;
      pen.lineWidth = 2;
      pen.stroke();
    }
    this.drawEye(pen, eye, yaw, wide);
  }

  /** The point of the model under a point of the window, at a height. */
  at(clientX: number, clientY: number, height: number): Vector3 {
    const { left, top } = this.canvas.getBoundingClientRect();
    const [x, z] = this.place(0, 0);
    return new Vector3((clientX - left - x) / this.scale(), height, (clientY - top - z) / this.scale());
  }

  private drawEye(pen: CanvasRenderingContext2D, eye: Vector3, yaw: number, wide: number): void {
    const [x, y] = this.place(eye.x, eye.z);
    pen.beginPath();
    pen.moveTo(x, y);
    for (const side of [-0.5, 0.5]) pen.lineTo(x - 40 * Math.sin(yaw + side * wide), y - 40 * Math.cos(yaw + side * wide));
    pen.closePath();
    pen.fillStyle = '#d0202050';
    pen.fill();
    pen.beginPath();
    pen.arc(x, y, 4, 0, 2 * Math.PI);
    pen.fillStyle = '#d02020';
    pen.fill();
  }

  private scale(): number {
    const { columns, rows, step } = this.frame;
    return Math.min(this.canvas.clientWidth / (columns * step), this.canvas.clientHeight / (rows * step));
  }

  private place(x: number, z: number): [number, number] {
    const { columns, rows, step } = this.frame;
    const scale = this.scale();
    const [left, top] = [(this.canvas.clientWidth - columns * step * scale) / 2, (this.canvas.clientHeight - rows * step * scale) / 2];
    return [left + (x - this.frame.x) * scale, top + (z - this.frame.z) * scale];
  }

  /** The cells at a height. */
  private lookUp(height: number): void {
    const { x, z, step, columns, rows } = this.frame;
    this.height = height;
    this.cells = new Int32Array(columns * rows);
    const point = new Vector3();
    for (let row = 0; row < rows; row++) {
      for (let column = 0; column < columns; column++) {
        this.cells[row * columns + column] = this.model.building.cellOf(point.set(x + (column + 0.5) * step, height, z + (row + 0.5) * step));
      }
    }
    Object.assign(this.picture, { width: columns, height: rows });
  }

  /** Cells that are seen have a colour, others are grey; walls are white. */
  private paint(): void {
    const seen = new Set(this.model.view.cells());
    const pen = this.picture.getContext('2d')!;
    const image = pen.createImageData(this.picture.width, this.picture.height);
    const pixels = new Uint32Array(image.data.buffer);
    for (let i = 0; i < this.cells.length; i++) {
      const cell = this.cells[i]!;
      pixels[i] = cell < 0 ? 0xffffffff : seen.has(cell) ? colourOf(cell) : 0xffdedede;
    }
    pen.putImageData(image, 0, 0);
  }
}

/** A pale colour, as the four bytes of a pixel. */
function colourOf(cell: number): number {
  const hue = (cell * 0.61803398875) % 1;
  const part = (shift: number): number => Math.round(185 + 55 * Math.cos(2 * Math.PI * (hue + shift)));
  return (0xff000000 | part(0.33) << 16 | part(0.67) << 8 | part(0)) >>> 0;
}
