// Each function of the package with the types of its arguments: checked by TypeScript, and run under node.
import {
    Halflight, NONE, load, toExr, toRgba, type ErrorEstimate, type Hits, type Irradiance, type Probes,
    type SceneDescription,
} from 'halflight';
import { Pool, type State } from 'halflight/pool.js';
import { fillProbes, probeGrid, type ProbeGrid } from 'halflight/probes.js';
import { framing, fromThree, toProbeGrid } from 'halflight/three.js';

const halflight: Halflight = await load();
const description: SceneDescription = {
    positions: Float32Array.from([-2, 0, -2, -2, 0, 2, 2, 0, 2, 2, 0, -2, -0.5, 2, -0.5, 0.5, 2, -0.5, 0, 2, 0.5]),
    triangles: Uint32Array.from([0, 1, 2, 0, 2, 3, 4, 5, 6]),
    triangleMaterials: Uint32Array.from([0, 0, 1]),
    materials: [{ surface: 'coated', color: [0.7, 0.6, 0.5], colorTexture: 0, roughness: 0.4 }, { emission: 10 }],
    textures: [{ width: 1, height: 1, linear: Float32Array.of(1, 1, 1), clamps: true }],
    lights: [{ kind: 'point', position: [0, 1, 0], power: 1 }],
    environment: { radiance: 0.1 },
};
const scene = halflight.scene({ ...description, camera: framing(description.positions) });

const renderer = scene.renderer({ width: 16, height: 12, method: 'path', seed: 1, maxDepth: 8, reconstruct: false });
renderer.step({ samples: 8 });
renderer.step({ error: 0.1 });
const error: ErrorEstimate | null = renderer.error();
const picture: Float32Array = renderer.picture();
const bytes: number = toRgba(picture, 1).length + toExr(picture, 16, 12).length;
const part = scene.renderer({ width: 16, height: 12, method: 'path', shard: 0, shards: 1 });
part.step({ samples: 8 });
renderer.take({ film: part.film(), shard: 0, shards: 1, samples: part.samples });

const points: Irradiance = scene.irradiance(Float32Array.of(0, 0, 0, 0, 1, 0), { samples: 64, light: 'direct' });
const grid: ProbeGrid = probeGrid(description, [2, 2, 2], [[-1, 0.5, -1], [1, 1.5, 1]]);
const probes: Probes = scene.probes(grid.places, { samples: 16 });
fillProbes(grid, probes);

const bvh = halflight.bvh(description);
const hits: Hits = bvh.nearest(Float32Array.of(0.5, 1, -0.5, Infinity, 0, -1, 0), { coherent: true });
const occluded: Uint8Array = bvh.occluded(Float32Array.of(0, 1, 0, 5, 0, 1, 0));
const tree = halflight.points(description.positions);
const { indices, squaredDistances } = tree.nearest(Float32Array.of(0, 2, 0), 2, 10);
const { values, vectors } = halflight.eigen3(Float32Array.of(2, 0, 0, 3, 0, 5));

/** Functions that need a browser. */
export async function inBrowser(three: { LightProbeGridWebGL: new () => object }, object: object, camera: object) {
    const pool: Pool = await Pool.open(fromThree(object, camera), { count: 2 });
    const onProgress = ({ picture, samples, method }: State) => console.log(picture?.length, samples, method);
    const last: State = await pool.render({ width: 16, height: 12 }, { samples: 4, error: 0.1, onProgress });
    const baked: Irradiance = await pool.irradiance(Float32Array.of(0, 0, 0, 0, 1, 0));
    const light: object = toProbeGrid(three, grid, await pool.probes(grid.places));
    pool.close();
    return { last, baked, light };
}

const { coefficients, halfWidths, inside } = probes;
const sound = error !== null && error.lower <= error.relmse && error.relmse <= error.upper && renderer.method === 'path'
    && bytes > 0 && renderer.samples >= 8 && points.lower[0] <= points.upper[0] && points.samples[0] >= 64
    && coefficients.length === 8 * 27 && halfWidths.length === 8 * 9 && inside.every((value) => value === 0)
    && hits.triangle[0] === 1 && hits.t[0] === 1 && occluded[0] === 1 && indices[0] !== NONE
    && squaredDistances[0] <= squaredDistances[1] && values.join() === '5,3,2' && vectors.length === 9;
if (!sound) throw new Error('a value is not that of the scene');
for (const object of [part, renderer, scene, bvh, tree]) object.free();
console.log('each function works');
