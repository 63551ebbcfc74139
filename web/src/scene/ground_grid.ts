import * as THREE from 'three';

/** A quiet grid through the world's origin, across y: 10 cm squares, 2 m wide. */
export function groundGrid(): THREE.Object3D {
  const grid = new THREE.GridHelper(2, 20, '#4a4e53', '#2c2f33');
  return grid;
}
