import { Vector3, type PerspectiveCamera } from 'three';

/** Metres a second, and that with Shift. */
const WALK = 1.4;
const FAST = 5;
/** Radians a second by arrows, and a pixel by the mouse and by a thumb. */
const TURN = 1.6;
const BY_MOUSE = 0.0025;
const BY_THUMB = 0.006;
const STEEPEST = 1.5;
/** Pixels of a thumb's way that are the full speed. */
const THUMB_WAY = 50;
/** The eye stays so far from walls, metres. */
const AWAY = 0.15;

/** Whether the eye may be at a point, coming from another. */
export type Passes = (from: Vector3, to: Vector3) => boolean;

/** The eye, moved by keys, mouse and thumbs. */
export class Walker {
  readonly eye = new Vector3();
  yaw = 0;
  pitch = 0;
  /** Walls stop the eye. */
  walls = true;
  private readonly held = new Set<string>();
  private readonly thumbs = new Map<number, { isWalking: boolean; from: [number, number]; at: [number, number] }>();
  private readonly next = new Vector3();
  private readonly probe = new Vector3();

  constructor(private readonly canvas: HTMLCanvasElement, private readonly click: (x: number, y: number) => void) {
    window.addEventListener('keydown', (event) => {
      if (!event.ctrlKey && !event.altKey && !event.metaKey && !(event.target instanceof HTMLInputElement)) this.held.add(event.code);
      if (/^(Arrow|Space)/.test(event.code) && event.target === canvas) event.preventDefault();
    });
    window.addEventListener('keyup', (event) => this.held.delete(event.code));
    window.addEventListener('blur', () => this.held.clear());
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.moved(event));
    for (const name of ['pointerup', 'pointercancel'] as const) canvas.addEventListener(name, (event) => this.up(event));
  }

  /** Turns towards a point. */
  look(at: Vector3): void {
    const way = this.next.subVectors(at, this.eye);
    this.yaw = Math.atan2(-way.x, -way.z);
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, Math.atan2(way.y, Math.hypot(way.x, way.z))));
  }

  /** Moves for some seconds, and puts the camera there. */
  step(seconds: number, camera: PerspectiveCamera, passes: Passes): void {
    this.yaw += TURN * seconds * (this.is('ArrowLeft') - this.is('ArrowRight'));
    this.pitch += TURN * seconds * (this.is('ArrowUp') - this.is('ArrowDown'));
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, this.pitch));
    let [right, ahead] = [this.is('KeyD') - this.is('KeyA'), this.is('KeyW') - this.is('KeyS')];
    for (const { isWalking, from, at } of this.thumbs.values()) {
      if (!isWalking) continue;
      right += clamp((at[0] - from[0]) / THUMB_WAY);
      ahead -= clamp((at[1] - from[1]) / THUMB_WAY);
    }
    const up = this.is('Space') - this.is('KeyC');
    const length = Math.hypot(right, ahead, up);
    if (length > 0) this.move((this.is('ShiftLeft') + this.is('ShiftRight') > 0 ? FAST : WALK) * seconds / Math.max(length, 1), right, ahead, up, passes);
    camera.position.copy(this.eye);
    camera.rotation.set(this.pitch, this.yaw, 0, 'YXZ');
  }

  private is(code: string): number {
    return this.held.has(code) ? 1 : 0;
  }

  /** Walks as far as walls let it: along one axis if not along both. */
  private move(metres: number, right: number, ahead: number, up: number, passes: Passes): void {
    const [sin, cos] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const [x, y, z] = [metres * (cos * right - sin * ahead), metres * up, metres * (-sin * right - cos * ahead)];
    if (this.try(x, y, z, passes) || this.try(x, 0, 0, passes) || this.try(0, 0, z, passes)) return;
    this.try(0, y, 0, passes);
  }

  private try(x: number, y: number, z: number, passes: Passes): boolean {
    const way = Math.hypot(x, y, z);
    if (way === 0) return false;
    this.next.set(this.eye.x + x, this.eye.y + y, this.eye.z + z);
    const beyond = 1 + AWAY / way;
    this.probe.set(this.eye.x + x * beyond, this.eye.y + y * beyond, this.eye.z + z * beyond);
    if (this.walls && !passes(this.eye, this.probe)) return false;
    this.eye.copy(this.next);
    return true;
  }

  private down(event: PointerEvent): void {
    this.canvas.focus();
    if (event.pointerType === 'mouse') {
      if (document.pointerLockElement === this.canvas) return this.click(window.innerWidth / 2, window.innerHeight / 2);
    } else {
      event.preventDefault();
    }
    this.canvas.setPointerCapture(event.pointerId);
    const at: [number, number] = [event.clientX, event.clientY];
    const isWalking = event.pointerType === 'touch' && event.clientX < window.innerWidth / 2;
    this.thumbs.set(event.pointerId, { isWalking, from: at, at });
  }

  private moved(event: PointerEvent): void {
    if (document.pointerLockElement === this.canvas) return this.turn(event.movementX * BY_MOUSE, event.movementY * BY_MOUSE);
    const thumb = this.thumbs.get(event.pointerId);
    if (!thumb) return;
    const [x, y] = thumb.at;
    thumb.at = [event.clientX, event.clientY];
    const by = event.pointerType === 'touch' ? BY_THUMB : 2 * BY_MOUSE;
    if (!thumb.isWalking) this.turn((event.clientX - x) * by, (event.clientY - y) * by);
  }

  private up(event: PointerEvent): void {
    const thumb = this.thumbs.get(event.pointerId);
    this.thumbs.delete(event.pointerId);
    if (!thumb || event.type === 'pointercancel') return;
    if (Math.hypot(event.clientX - thumb.from[0], event.clientY - thumb.from[1]) < 6) this.click(event.clientX, event.clientY);
  }

  private turn(x: number, y: number): void {
    this.yaw -= x;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, this.pitch - y));
  }
}

function clamp(x: number): number {
  return Math.max(-1, Math.min(1, x));
}
