// Fingerprints of pictures by each method and of irradiances, as core/bindings/c/tests/bits.c prints them; then checks
// of the other functions, which throw.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { NONE, load, toExr, toRgba } from '../halflight.js';
import { fillProbes, probeGrid } from '../probes.js';

const module = await WebAssembly.compile(await readFile(process.argv[2]));
assert.deepEqual(WebAssembly.Module.imports(module), []);
const halflight = await load(module);

const room = {
    positions: Float32Array.from([-2, 0, -2, -2, 0, 2, 2, 0, 2, 2, 0, -2, -0.5, 2, -0.5, 0.5, 2, -0.5, 0, 2, 0.5]),
    triangles: Uint32Array.from([0, 1, 2, 0, 2, 3, 4, 5, 6]),
    triangleMaterials: Uint32Array.from([0, 0, 1]),
    materials: [{ color: 0.7 }, { emission: 10 }],
    camera: { eye: [0, 2, 6], target: [0, 0, 0], up: [0, 1, 0], fov: 40, focusDistance: 0 },
};

function fingerprint(values) {
    let hash = 0xcbf29ce484222325n;
    for (const byte of new Uint8Array(values.buffer)) {
        hash = BigInt.asUintN(64, (hash ^ BigInt(byte)) * 0x100000001b3n);
    }
    return hash.toString(16).padStart(16, '0');
}

const scene = halflight.scene(room);
const size = { width: 32, height: 24 };
const methods = ['path', 'irradiance-cache', 'radiance-cache', 'photon-map', 'sppm', 'light', 'bdpt', 'vcm',
    'instant-radiosity', 'instant-radiosity-clamped', 'mlt'];
for (const method of methods) {
    const renderer = scene.renderer({ ...size, method });
    renderer.step({ samples: 8 });
    assert.equal(renderer.method, method);
    console.log(fingerprint(renderer.picture()));
    renderer.free();
}
const points = Float32Array.from([0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0]);
const { irradiance, lower, upper, samples } = scene.irradiance(points, { samples: 256 });
console.log(fingerprint(irradiance));
assert.ok(lower[0] <= irradiance[1] && irradiance[1] <= upper[0] && samples[0] >= 256);

// A probe below a white sky has its radiance, and no harmonics of degree 1 and 2; a place in a box is inside.
const cube = {
    positions: Float32Array.from({ length: 24 }, (_, i) => (((i / 3) >> (i % 3)) & 1 ? 3 : 2)),
    triangles: Uint32Array.from([0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1,
        4, 5, 7, 4, 7, 6]),
    materials: [{ color: 0 }],
    environment: 2,
};
const sky = halflight.scene(cube);
const { coefficients, halfWidths, inside } = sky.probes(Float32Array.from([-60, 0, 0, 2.5, 2.5, 2.5]), { samples: 64 });
assert.deepEqual([...inside], [0, 1]);
assert.ok(Math.abs(coefficients[0] / (2 * Math.sqrt(4 * Math.PI)) - 1) < 0.01, `${coefficients[0]}`);
for (let i = 1; i < 9; i++) assert.ok(Math.abs(coefficients[3 * i]) <= 3 * halfWidths[i] + 0.01, `${i}`);
const grid = probeGrid(cube, [2, 1, 1]);
assert.deepEqual([...grid.places], [2.25, 2.5, 2.5, 2.75, 2.5, 2.5]);
const probes = { coefficients: Float32Array.from({ length: 54 }, (_, i) => i), halfWidths: new Float32Array(18), inside: Uint8Array.of(0, 1) };
fillProbes(grid, probes);
assert.equal(probes.coefficients[30], 3);

// Two shards joined are the whole.
const whole = scene.renderer({ ...size, method: 'path' });
whole.step({ samples: 8 });
const joined = scene.renderer({ ...size, method: 'path' });
for (const shard of [0, 1]) {
    const part = scene.renderer({ ...size, method: 'path', shard, shards: 2 });
    part.step({ samples: 8 });
    joined.take({ film: part.film(), shard, shards: 2, samples: part.samples });
    part.free();
}
joined.step({ samples: 0 });
assert.deepEqual(joined.picture(), whole.picture());
assert.deepEqual(joined.error(), whole.error());
assert.equal(joined.samples, 8);

// An error that is reached.
whole.step({ error: 0.01 });
assert.ok(whole.error().upper <= 0.01);

// Rays, points, matrices.
const bvh = halflight.bvh(room);
const hits = bvh.nearest(Float32Array.from([0.5, 1, -0.5, Infinity, 0, -1, 0, 9, 1, 9, Infinity, 0, -1, 0]));
assert.deepEqual([...hits.triangle], [1, NONE]);
assert.deepEqual([...hits.t], [1, Infinity]);
assert.deepEqual([...bvh.occluded(Float32Array.from([0, 1, 0, 5, 0, 1, 0]))], [1]);
const tree = halflight.points(Float32Array.from({ length: 300 }, (_, i) => (i % 3 === 0 ? i / 3 : 0)));
assert.deepEqual([...tree.nearest(Float32Array.from([7.2, 0, 0]), 2).indices], [7, 8]);
const { values } = halflight.eigen3(Float32Array.from([2, 0, 0, 3, 0, 5]));
assert.deepEqual([...values], [5, 3, 2]);

// Mistakes are named.
assert.throws(() => scene.renderer({ ...size, method: 'magic' }), /no method `magic`; there are auto, path/);
assert.throws(() => scene.renderer({ width: 0, height: 5 }), /a picture has 1 to 2\^28 pixels/);
assert.throws(() => halflight.scene({ ...room, triangles: Uint32Array.from([0, 1, 99, 0, 2, 3, 4, 5, 6]) }), /vertex or a material/);
assert.throws(() => halflight.scene({ ...room, camera: { fov: 400 } }), /at most 178 degrees, and not 400/);
assert.throws(() => halflight.scene({ ...room, materials: [{ surface: 'slime' }] }), /`slime`; it can be diffuse/);
assert.throws(() => halflight.scene({ triangles: room.triangles }), /positions is no array/);
assert.throws(() => joined.free() ?? joined.picture(), /memory of this object is free/);
assert.throws(() => scene.irradiance(new Float32Array(7)), /points has 7 numbers, and not a multiple of 6/);
assert.throws(() => halflight.scene({ ...room, textures: [{ width: 2, height: 2, srgb: new Uint8Array(4) }] }),
    /texture 0 has 4 numbers, and not 2 x 2 x 4/);
assert.throws(() => halflight.bvh({ ...room, normals: Float32Array.from([1]) }), /normals has 1 numbers, and not 21/);

// Pictures as files.
const picture = whole.picture();
assert.equal(toRgba(picture).length, 4 * 32 * 24);
assert.equal(new DataView(toExr(picture, 32, 24).buffer).getUint32(0, true), 20000630);

// Freed memory is used again.
const texels = new Uint8Array(1 << 20);
const before = halflight.exports.memory.buffer.byteLength;
for (let i = 0; i < 200; i++) {
    const again = scene.renderer({ ...size, method: 'path' });
    again.step({ samples: 1 });
    again.picture();
    again.free();
    // A scene that is refused keeps nothing.
    const textures = [{ width: 512, height: 512, srgb: texels }];
    assert.throws(() => halflight.scene({ ...room, textures, materials: [{ colorTexture: 7 }] }));
}
assert.equal(halflight.exports.memory.buffer.byteLength, before);
