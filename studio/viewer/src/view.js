// The picture: camera, light, beam, and what lies under the pointer.
import {
  Box3, Color, ColorManagement, CylinderGeometry, DirectionalLight, Group, HemisphereLight, LinearSRGBColorSpace, Mesh,
  MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Raycaster, Scene, Spherical, Vector2, Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { COLOUR } from "./palette.js";
import { Part } from "./part.js";
import { Rotary, Sheet } from "./sheet.js";
import { ease } from "./timeline.js";

const CREASE_PIXELS = 9;
const HOME = new Vector3().setFromSpherical(new Spherical(4.1, 0.95, 0.65)).applyAxisAngle(new Vector3(1, 0, 0), Math.PI / 2);

/** Without a graphics card the processor draws every pixel: then edges are not smoothed, so that it stays fluent. */
function drawnByProcessor() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return false;
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

class Beam extends Group {
  constructor(radius) {
    super();
    const long = 0.75 * radius, wide = 0.03 * radius;
    const light = new Mesh(
      new CylinderGeometry(wide, 0.12 * wide, long, 20, 1, true),
      new MeshBasicMaterial({ color: new Color(...COLOUR.glow), transparent: true, opacity: 0.55, depthWrite: false, side: 2 }),
    );
    light.position.z = 0.5 * long;
    const head = new Mesh(
      new CylinderGeometry(2.2 * wide, 1.3 * wide, 4 * wide, 20),
      new MeshLambertMaterial({ color: new Color(...COLOUR.machine) }),
    );
    head.position.z = long + 2 * wide;
    light.rotation.x = head.rotation.x = Math.PI / 2;
    this.add(light, head);
  }
}

/** Canvas, scene and camera. Throws where the browser has no WebGL 2. */
export class View {
  constructor(canvas, plan, timeline, goal) {
    this.canvas = canvas;
    this.plan = plan;
    this.timeline = timeline;
    ColorManagement.enabled = false;
    const fast = !drawnByProcessor();
    this.mostPixels = fast ? 2 : 1;
    this.renderer = new WebGLRenderer({ canvas, antialias: fast, alpha: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.scene = new Scene();
    this.stage = new Group();
    this.machine = new Group();
    this.part = new Part(plan, timeline, goal);
    this.sheet = new Sheet(plan, timeline);
    this.rotary = new Rotary(plan, this.sheet.radius);
    this.beam = new Beam(this.sheet.radius);
    this.machine.add(this.part, this.sheet, this.rotary);
    this.stage.add(this.machine, this.beam);
    this.camera = new PerspectiveCamera(30, 1, 0.05, 60);
    this.camera.up.set(0, 0, 1);
    const lamp = new DirectionalLight(0xffffff, 1.9);
    lamp.position.set(-1.2, 1.8, 2.5);
    this.camera.add(lamp);
    this.scene.add(this.stage, this.camera, new HemisphereLight(0xffffff, 0xd5dae0, 2.1));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.minDistance = 0.4;
    this.controls.maxDistance = 14;
    this.controls.addEventListener("change", () => this.render());
    this.reset();
  }

  reset() {
    this.camera.position.copy(HOME);
    this.controls.target.set(0, 0, 0);
    this.controls.update();
  }

  /** Show corners (mm) and state; `look` says what is shown and marked. */
  update(corners, state, look) {
    this.machine.rotation.x = look.machine ? state.rotary : 0;
    this.part.update(corners, state, look);
    const cut = this.sheet.update(state, look.sheet);
    this.rotary.visible = look.machine && state.release < 1;
    this.aim(state, look, cut);
    this.frame(state, look);
    this.render();
  }

  /** The beam falls along -z of the machine on the crease that is burnt, or where it cuts. */
  aim(state, look, cut) {
    let spot = cut;
    if (state.active >= 0) {
      const [a, b] = this.part.hinge(state.active), back = (6 * state.share) % 2;
      spot = a.lerp(b, back > 1 ? 2 - back : back);
    }
    this.beam.visible = look.beam && spot !== null;
    if (this.beam.visible) this.beam.position.copy(spot).applyAxisAngle(new Vector3(1, 0, 0), this.machine.rotation.x);
  }

  /** Keep the whole sheet in view while it is there, and the part when it is free; sizes are then about one. */
  frame(state, look) {
    const box = new Box3().setFromBufferAttribute(this.part.position_);
    const near = 0.5 * box.getSize(new Vector3()).length() || 1, free = look.sheet ? ease(state.release) : 1;
    const far = Math.max(1.05 * this.sheet.radius, near), radius = far + (near - far) * free;
    const middle = box.getCenter(new Vector3()).applyAxisAngle(new Vector3(1, 0, 0), this.machine.rotation.x);
    this.stage.scale.setScalar(1 / radius);
    this.stage.position.copy(middle).multiplyScalar(-free / radius);
  }

  render() {
    const { canvas, renderer, camera } = this, w = Math.max(canvas.clientWidth, 1), h = Math.max(canvas.clientHeight, 1);
    const size = renderer.getSize(new Vector2()), ratio = Math.min(window.devicePixelRatio || 1, this.mostPixels);
    if (size.x !== w || size.y !== h || renderer.getPixelRatio() !== ratio) {
      renderer.setPixelRatio(ratio);
      renderer.setSize(w, h, false);
      camera.aspect = w / h;
      camera.fov = 30 * Math.max(1, 0.95 / camera.aspect);
      camera.updateProjectionMatrix();
    }
    renderer.render(this.scene, camera);
  }

  turn(sideways, upwards) {
    const from = new Spherical().setFromVector3(
      this.camera.position.clone().sub(this.controls.target).applyAxisAngle(new Vector3(1, 0, 0), -Math.PI / 2),
    );
    from.theta += sideways;
    from.phi = Math.min(Math.max(from.phi + upwards, 0.01), Math.PI - 0.01);
    const to = new Vector3().setFromSpherical(from).applyAxisAngle(new Vector3(1, 0, 0), Math.PI / 2);
    this.camera.position.copy(to.add(this.controls.target));
    this.controls.update();
    this.render();
  }

  zoom(factor) {
    this.camera.position.sub(this.controls.target).divideScalar(factor).clampLength(0.4, 14).add(this.controls.target);
    this.controls.update();
    this.render();
  }

  /** Face under a pointer event, and its crease if the pointer is near one; null beside the part. */
  under(event) {
    const frame = this.canvas.getBoundingClientRect(), to = new Vector2(
      (2 * (event.clientX - frame.left)) / frame.width - 1, 1 - (2 * (event.clientY - frame.top)) / frame.height,
    );
    const ray = new Raycaster();
    ray.setFromCamera(to, this.camera);
    this.part.mesh.geometry.computeBoundingSphere();
    const [hit] = ray.intersectObject(this.part.mesh, false);
    if (!hit) return null;
    return { face: hit.faceIndex, crease: this.creaseNear(hit.faceIndex, event.clientX - frame.left, event.clientY - frame.top) };
  }

  creaseNear(face, x, y) {
    let best = CREASE_PIXELS, found = -1;
    this.plan.creaseOf.forEach((crease, child) => {
      if (crease < 0 || (child !== face && this.plan.parent[child] !== face)) return;
      const [a, b] = this.part.hinge(child).map((p) => this.onScreen(p));
      const dx = b.x - a.x, dy = b.y - a.y, l = dx * dx + dy * dy || 1;
      const f = Math.min(Math.max(((x - a.x) * dx + (y - a.y) * dy) / l, 0), 1);
      const away = Math.hypot(a.x + f * dx - x, a.y + f * dy - y);
      if (away < best) { best = away; found = crease; }
    });
    return found;
  }

  /** Place of a point of the sheet frame on the canvas, in CSS pixels. */
  onScreen(point) {
    this.scene.updateMatrixWorld();
    const p = point.clone().applyMatrix4(this.machine.matrixWorld).project(this.camera);
    return { x: 0.5 * (p.x + 1) * this.canvas.clientWidth, y: 0.5 * (1 - p.y) * this.canvas.clientHeight };
  }
}
