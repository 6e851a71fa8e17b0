import type { Camera, Probes, SceneDescription } from './halflight.js';
import type { ProbeGrid } from './probes.js';

/** The description of a scene of three.js, or of any object of one; `notes` say what is left out. */
export function fromThree(scene: object, camera?: object): SceneDescription & { notes: string[] };
/** A camera that sees all points from the front and a little above. */
export function framing(positions: ArrayLike<number>, fov?: number): Camera;
/** Probes as a light of three.js: `three` is its module, with `LightProbeGridWebGL` of `three/addons/lighting`. */
export function toProbeGrid<Light>(
    three: { LightProbeGridWebGL: new (...sides: number[]) => Light; [name: string]: unknown },
    grid: ProbeGrid,
    probes: Probes,
): Light;
