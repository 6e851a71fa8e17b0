import type { Camera, SceneDescription } from './halflight.js';

export function fromThree(scene: object, camera?: object): SceneDescription & { notes: string[] };
export function framing(positions: ArrayLike<number>, fov?: number): Camera;
