import {
  BackSide, Color, CustomToneMapping, DirectionalLight, HemisphereLight, Mesh, PerspectiveCamera, Scene, ShaderChunk, ShaderMaterial, SphereGeometry, Vector3,
  WebGLRenderer,
} from 'three';

/** Metres to the near and the far plane. */
const NEAR = 0.05;
const FAR = 2000;
const FOV_DEGREES = 60;

// The light is the desktop viewer's: its sky, its ground, and its curve, which brings bright things near to white.
const CURVE = 'vec3 CustomToneMapping( vec3 color ) { return color; }';
ShaderChunk.tonemapping_pars_fragment = ShaderChunk.tonemapping_pars_fragment.replace(
  CURVE, 'vec3 CustomToneMapping( vec3 color ) { return 1.0 - exp( -1.7 * color ); }');
const SKY = new Color().setRGB(0.70, 0.73, 0.77);
const GROUND = new Color().setRGB(0.43, 0.40, 0.37);
const SUN = new Color().setRGB(1.0, 0.92, 0.79);
/** Walls let it through, since they cast no shadows: so it is weak. */
const SUN_INTENSITY = 0.45;
const TOWARDS_SUN = new Vector3(0.45, 0.75, 0.3);

/** The sky: pale at the horizon, blue above. It is drawn as it is, without the curve. */
function sky(): Mesh {
  const material = new ShaderMaterial({
    side: BackSide,
    depthWrite: false,
    vertexShader: 'varying vec3 way; void main() { way = position; gl_Position = ( projectionMatrix * mat4( mat3( viewMatrix ) ) * vec4( position, 1.0 ) ).xyww; }',
    fragmentShader: `varying vec3 way; void main() {
      float up = clamp( normalize( way ).y, 0.0, 1.0 );
      gl_FragColor = vec4( mix( vec3( 0.83, 0.88, 0.93 ), vec3( 0.42, 0.60, 0.84 ), sqrt( up ) ), 1.0 );
    }`,
  });
  const mesh = new Mesh(new SphereGeometry(1, 32, 16), material);
  mesh.frustumCulled = false;
  mesh.renderOrder = -1;
  return mesh;
}

/** What is drawn, and by what. */
export class Stage {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  /** Its matrices are in doubles. */
  readonly camera = new PerspectiveCamera(FOV_DEGREES, 1, NEAR, FAR);

  /** Throws an `Error` if the browser has no WebGL2. */
  constructor(canvas: HTMLCanvasElement, restored: () => void, lost: () => void) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.toneMapping = CustomToneMapping;
    this.renderer.info.autoReset = false;
    const sun = new DirectionalLight(SUN, SUN_INTENSITY * Math.PI);
    sun.position.copy(TOWARDS_SUN);
    this.scene.add(new HemisphereLight(SKY, GROUND, Math.PI), sun, sky());
    // Only then the browser restores it.
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      lost();
    });
    canvas.addEventListener('webglcontextrestored', restored);
    this.resize();
  }

  /** Takes the size of the window. */
  resize(): void {
    const [width, height] = [window.innerWidth, window.innerHeight];
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  draw(): void {
    this.renderer.info.reset();
    this.renderer.render(this.scene, this.camera);
  }
}
