import * as THREE from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { threeFromWorld, threeOrientation, worldFromThree } from '../geometry/axes';
import type { Rigid3 } from '../geometry/rigid3';
import type { Vec3 } from '../geometry/vec3';
import type { Thing } from '../session/scene_book';
import { hiddenDepth, type LightUniforms, shaded } from './scene_light';

/** What is real hides what is more than this behind it, along the optic axis [m]. */
export const OCCLUSION_BIAS_M = 0.005;

/**
 * Depth alone, farther by the bias: written for z + bias rather than shifted in the depth buffer's own uneven
 * steps, as on the server (shared/render/scene_painter.cpp).
 */
export const depthOnly = (): THREE.ShaderMaterial =>
  new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    side: THREE.DoubleSide,
    colorWrite: false,
    uniforms: { biasM: { value: OCCLUSION_BIAS_M } },
    vertexShader: `
      out float depth;
      void main() {
        vec4 eye = modelViewMatrix * vec4(position, 1.0);
        depth = -eye.z;
        gl_Position = projectionMatrix * eye;
      }`,
    fragmentShader: `
      in float depth;
      uniform float biasM;
      uniform mat4 projectionMatrix;
      void main() {
        float z = depth + biasM;
        float ndc = -projectionMatrix[2][2] + projectionMatrix[3][2] / z;
        gl_FragDepth = clamp(0.5 * ndc + 0.5, 0.0, 1.0);
      }`,
  });

const EDGE_COLOUR = '#8b9097';
const ACCENT_COLOUR = '#c4b0ff';

const ORDER = { real: 0, virtual: 1, guide: 1, hidden: 3 } as const;

function shapeGeometry(thing: Thing): THREE.BufferGeometry {
  const { x, y, z } = thing.sizeM;
  if (thing.shape === 'plane') return new THREE.PlaneGeometry(x, z).rotateX(-Math.PI / 2);
  return new THREE.BoxGeometry(x, y, z).translate(0, y / 2, 0); // three.js: up is y
}

async function geometriesOf(
  thing: Thing,
  model: Uint8Array | undefined,
): Promise<{ geometry: THREE.BufferGeometry; color: THREE.Color }[]> {
  if (thing.shape !== 'model') {
    const color = new THREE.Color(thing.colorRgba >>> 8);
    return [{ geometry: shapeGeometry(thing), color }];
  }
  if (!model) return [];
  const bytes = model.slice().buffer;
  const { scene } = await new GLTFLoader().parseAsync(bytes, '');
  scene.updateMatrixWorld(true);
  const parts: { geometry: THREE.BufferGeometry; color: THREE.Color }[] = [];
  scene.traverse((node) => {
    if (!(node instanceof THREE.Mesh)) return;
    const mesh = node as THREE.Mesh<THREE.BufferGeometry, THREE.Material>;
    const { material } = mesh;
    const color = 'color' in material ? (material.color as THREE.Color) : new THREE.Color(0xb4b4b4);
    const geometry = mesh.geometry.clone().applyMatrix4(mesh.matrixWorld);
    parts.push({ geometry: geometry.scale(thing.scale, thing.scale, thing.scale), color });
  });
  return parts;
}

const MOST_POINTS = 50_000;

/** Where a model has corners, in its own frame before its scale, each once. */
export async function pointsOf(file: Uint8Array): Promise<Vec3[]> {
  const { scene } = await new GLTFLoader().parseAsync(file.slice().buffer, '');
  scene.updateMatrixWorld(true);
  const points = new Map<string, Vec3>();
  scene.traverse((node) => {
    if (!(node instanceof THREE.Mesh)) return;
    const mesh = node as THREE.Mesh;
    const at = mesh.geometry.getAttribute('position');
    const point = new THREE.Vector3();
    for (let i = 0; i < at.count && points.size < MOST_POINTS; i++) {
      point.fromBufferAttribute(at, i).applyMatrix4(mesh.matrixWorld);
      const key = point.toArray().map((value) => value.toFixed(4));
      points.set(key.join(), worldFromThree(point));
    }
  });
  return [...points.values()];
}

/** Turns of an edge that are drawn [deg]. */
const EDGE_DEG = 20;
const MOST_WITH_EDGES = 60_000; // vertices: edges are found by all of them

function edgesOf(geometry: THREE.BufferGeometry): THREE.LineSegments {
  const material = new THREE.LineBasicMaterial({ color: EDGE_COLOUR });
  const edges = new THREE.LineSegments(new THREE.EdgesGeometry(geometry, EDGE_DEG), material);
  edges.frustumCulled = false;
  edges.renderOrder = ORDER.virtual;
  return edges;
}

/**
 * A thing as three.js draws it, in its own frame; glTF's axes are three.js' own. `outside`: for an eye that is
 * not in the room: one sees into it through its near walls, and what is real has edges.
 */
export async function meshesOf(
  thing: Thing,
  model: Uint8Array | undefined,
  light: LightUniforms,
  outside = false,
): Promise<THREE.Group> {
  const group = new THREE.Group();
  for (const { geometry, color } of await geometriesOf(thing, model)) {
    const material =
      thing.material === 'real' ? depthOnly() : shaded(color, thing.material === 'hidden', light);
    if (outside && thing.shape === 'room') material.side = THREE.BackSide;
    const mesh = new THREE.Mesh(geometry, material);
    mesh.renderOrder = ORDER[thing.material];
    mesh.frustumCulled = false;
    group.add(mesh);
    if (thing.material === 'hidden') group.add(hiddenDepth(mesh));
    const few = geometry.getAttribute('position').count <= MOST_WITH_EDGES;
    if (outside && few && thing.material === 'real') group.add(edgesOf(geometry));
  }
  return group;
}

/** Edges of the selected thing stand out. */
export function accent(group: THREE.Group, selected: boolean): void {
  for (const child of group.children) {
    if (!(child instanceof THREE.LineSegments)) continue;
    const lines = child as THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
    lines.material.color.set(selected ? ACCENT_COLOUR : EDGE_COLOUR);
  }
}

/** Puts it where it is; undefined: nobody knows. */
export function pose(group: THREE.Group, world: Rigid3 | undefined): void {
  group.visible = world !== undefined;
  if (!world) return;
  const p = threeFromWorld(world.translation);
  const q = threeOrientation(world);
  group.position.set(p.x, p.y, p.z);
  group.quaternion.set(q.x, q.y, q.z, q.w);
}

export function dispose(group: THREE.Group): void {
  for (const child of group.children) {
    if (!(child instanceof THREE.Mesh || child instanceof THREE.LineSegments)) continue;
    const mesh = child as THREE.Mesh<THREE.BufferGeometry, THREE.Material>;
    mesh.geometry.dispose();
    mesh.material.dispose();
  }
}
