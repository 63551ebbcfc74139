import * as THREE from 'three';
import { threeFromWorld } from '../geometry/axes';
import type { Light } from '../session/scene_book';
import type { ShadowMesh } from './contact_shadow';

/** Of every material that is lit in one scene; `toward` in the eye's axes, three.js' own. */
export interface LightUniforms {
  readonly toward: { value: THREE.Vector3 };
  readonly level: { value: number };
  readonly confidence: { value: number };
}

export const lightUniforms = (): LightUniforms => ({
  toward: { value: new THREE.Vector3() },
  level: { value: 1 },
  confidence: { value: 0 },
});

/** The light as an eye sees it that is turned so. */
export function setLight(to: LightUniforms, light: Light, eye: THREE.Quaternion): void {
  const { x, y, z } = threeFromWorld(light.towardInWorld);
  to.toward.value.set(x, y, z).applyQuaternion(eye.clone().invert());
  to.level.value = light.level;
  to.confidence.value = light.confidence;
}

const HIDDEN_ALPHA = 0.65;

/** Linear as glTF and three.js have it, to what the server shows (shared/models/gltf_reader.cpp). */
const shown = ({ r, g, b }: THREE.Color): THREE.Vector3 =>
  new THREE.Vector3(r ** (1 / 2.2), g ** (1 / 2.2), b ** (1 / 2.2));

/**
 * Shaded as shared/render/scene_painter.cpp has it: by the light that is known, else by one at the eye. What is
 * hidden shows through everything. Colours are written as they are shown, times alpha.
 */
export function shaded(
  color: THREE.Color,
  hidden: boolean,
  light: LightUniforms,
): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    side: THREE.DoubleSide,
    uniforms: {
      ...light,
      paint: { value: shown(color) },
      alpha: { value: hidden ? HIDDEN_ALPHA : 1 },
    },
    transparent: hidden,
    ...premultiplied(hidden),
    vertexShader: `
      out vec3 point;
      void main() {
        vec4 eye = modelViewMatrix * vec4(position, 1.0);
        point = eye.xyz;
        gl_Position = projectionMatrix * eye;
      }`,
    fragmentShader: `
      in vec3 point;
      out vec4 color;
      uniform vec3 toward, paint;
      uniform float level, confidence, alpha;
      void main() {
        vec3 normal = normalize(cross(dFdx(point), dFdy(point)));
        vec3 line = normalize(point);
        if (dot(normal, line) > 0.0) normal = -normal;
        float facing = abs(dot(normal, line));
        float known = level * clamp(1.0 + dot(toward, normal), 0.25, 1.9) * (0.85 + 0.15 * facing);
        float light = mix(0.4 + 0.6 * facing, known, confidence);
        color = vec4(min(paint * light, vec3(1.0)), 1.0) * alpha;
      }`,
  });
}

/** Over what is there, by alpha; or in its place. */
const premultiplied = (over: boolean) =>
  over
    ? {
        blending: THREE.CustomBlending,
        blendSrc: THREE.OneFactor,
        blendDst: THREE.OneMinusSrcAlphaFactor,
      }
    : { blending: THREE.NoBlending };

/** What the pinhole saw, as it is. */
export const copied = (map: THREE.Texture): THREE.ShaderMaterial =>
  new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    uniforms: { map: { value: map } },
    blending: THREE.NoBlending,
    depthTest: false,
    vertexShader: `
      out vec2 at;
      void main() {
        at = uv;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `
      in vec2 at;
      out vec4 color;
      uniform sampler2D map;
      void main() { color = texture(map, at); }`,
  });

/** Contact shadows: over what is drawn, hidden by what is before them. */
export function shadowsOf({ positions, darkness, triangles }: ShadowMesh): THREE.Mesh {
  const geometry = new THREE.BufferGeometry();
  const at = positions.flatMap((p) => {
    const { x, y, z } = threeFromWorld(p);
    return [x, y, z];
  });
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(at, 3));
  geometry.setAttribute('darkness', new THREE.Float32BufferAttribute(darkness, 1));
  geometry.setIndex(triangles.flat());
  const material = new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    side: THREE.DoubleSide,
    transparent: true,
    depthWrite: false,
    ...premultiplied(true),
    vertexShader: `
      in float darkness;
      out float dark;
      void main() {
        dark = darkness;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `
      in float dark;
      out vec4 color;
      void main() { color = vec4(0.0, 0.0, 0.0, dark); }`,
  });
  const mesh = new THREE.Mesh(geometry, material);
  mesh.renderOrder = 2; // after what is drawn, before what is hidden
  mesh.frustumCulled = false;
  return mesh;
}

/** The depth of something hidden, before its colours: of it the nearest surface alone is seen. */
export function hiddenDepth({ geometry, material }: THREE.Mesh): THREE.Mesh {
  const depth = (material as THREE.ShaderMaterial).clone(); // the same places to the last bit
  depth.colorWrite = false;
  const mesh = new THREE.Mesh(geometry, depth);
  mesh.renderOrder = 2.7;
  mesh.frustumCulled = false;
  return mesh;
}

/** Before what is hidden: it shows through what is drawn, and hides itself alone. */
export function wipesDepth(): THREE.Mesh {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(new Array(9).fill(0), 3));
  const material = new THREE.MeshBasicMaterial({ colorWrite: false, transparent: true });
  material.depthWrite = false;
  const mesh = new THREE.Mesh(geometry, material);
  mesh.renderOrder = 2.5;
  mesh.frustumCulled = false;
  mesh.onBeforeRender = (renderer) => {
    renderer.state.buffers.depth.setMask(true); // else it clears nothing
    renderer.clearDepth();
  };
  return mesh;
}
