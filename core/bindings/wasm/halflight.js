// Scenes, pictures, irradiance, ray traversal and nearest points by WebAssembly. The module `halflight.wasm` has the
// functions of core/bindings/c/include/halflight.h and no imports; this file lays out their arguments in its memory.

const STATUS_OK = 0;
const PAGE = 65536;
const SURFACES = { diffuse: 0, mirror: 1, metal: 2, coated: 3, glass: 4, pane: 5 };
const LIGHTS = { point: 0, spot: 1, directional: 2 };
const METHODS = [
    'auto', 'path', 'irradiance-cache', 'radiance-cache', 'photon-map', 'sppm', 'light', 'bdpt', 'vcm',
    'instant-radiosity', 'instant-radiosity-clamped', 'mlt',
];
const LIGHT_PARTS = { all: 0, direct: 1, indirect: 2 };

/** Index of no triangle and of no point. */
export const NONE = 0xffffffff;

/** Instantiates the module: from `source`, its bytes, a compiled module or an address; by default the file beside. */
export async function load(source = new URL('./halflight.wasm', import.meta.url)) {
    const isAddress = typeof source === 'string' || source instanceof URL;
    const module = source instanceof WebAssembly.Module ? source
        : await WebAssembly.compile(isAddress ? await bytesAt(source) : source);
    const instance = await WebAssembly.instantiate(module, {});
    return new Halflight(module, instance.exports);
}

async function bytesAt(address) {
    if (String(address).startsWith('file:')) {
        // Node has no `fetch` of files. Bundlers do not follow a name in a variable.
        const files = 'node:fs/promises';
        return (await import(/* @vite-ignore */ files)).readFile(new URL(address));
    }
    const response = await fetch(address);
    if (!response.ok) throw new Error(`halflight: ${address} is not there: ${response.status} ${response.statusText}`);
    return response.arrayBuffer();
}

/** Blocks of the module's memory, in whole cache lines. Memory grows and is never given back to the browser. */
class Blocks {
    constructor(memory) {
        this.memory = memory;
        this.free = [];
        this.taken = new Map();
    }

    take(bytes) {
        const size = Math.max(64, Math.ceil(bytes / 64) * 64);
        let index = this.free.findIndex((block) => block.size >= size);
        if (index < 0) {
            const pages = Math.ceil(size / PAGE);
            let at;
            try {
                at = this.memory.grow(pages) * PAGE;
            } catch {
                throw new RangeError(`halflight: the browser gives no ${bytes} bytes more`);
            }
            this.release({ at, size: pages * PAGE });
            index = this.free.findIndex((block) => block.size >= size);
        }
        const block = this.free[index];
        this.taken.set(block.at, size);
        const at = block.at;
        if (block.size > size) {
            block.at += size;
            block.size -= size;
        } else {
            this.free.splice(index, 1);
        }
        return at;
    }

    give(at) {
        const size = this.taken.get(at);
        if (size === undefined) return;
        this.taken.delete(at);
        this.release({ at, size });
    }

    /** Adds a free block, joined with its neighbours. */
    release(block) {
        const next = this.free.findIndex((other) => other.at > block.at);
        const index = next < 0 ? this.free.length : next;
        this.free.splice(index, 0, block);
        for (const first of [index, index - 1]) {
            const [a, b] = [this.free[first], this.free[first + 1]];
            if (a && b && a.at + a.size === b.at) {
                a.size += b.size;
                this.free.splice(first + 1, 1);
            }
        }
    }
}

/** Writes a structure of C: fields in order, each at a multiple of its size. */
class Structure {
    constructor(view, at) {
        this.view = view;
        this.at = at;
        this.first = at;
    }

    u32(...values) {
        for (const value of values) {
            this.align(4);
            this.view.setUint32(this.at, value ?? 0, true);
            this.at += 4;
        }
        return this;
    }

    f32(...values) {
        for (const value of values) {
            this.align(4);
            this.view.setFloat32(this.at, value ?? 0, true);
            this.at += 4;
        }
        return this;
    }

    bool(value) {
        this.view.setUint8(this.at++, value ? 1 : 0);
        return this;
    }

    align(size) {
        this.at += (size - (this.at % size)) % size;
        return this;
    }
}

const MESH_BYTES = 44;
const MATERIAL_BYTES = 68;
const TEXTURE_BYTES = 20;
const LIGHT_BYTES = 48;
const CAMERA_BYTES = 48;
const PROBE_NORMALS = 24;

const triple = (value) => (typeof value === 'number' ? [value, value, value] : [...(value ?? [0, 0, 0])]);

function choice(names, name, what) {
    const value = names[name];
    if (value === undefined) {
        throw new RangeError(`halflight: ${what} is \`${name}\`; it can be ${Object.keys(names).join(', ')}`);
    }
    return value;
}

function method(name = 'auto') {
    const number = METHODS.indexOf(name);
    if (number < 0) throw new RangeError(`halflight: there is no method \`${name}\`; there are ${METHODS.join(', ')}`);
    return number;
}

/** Number of items of `each` numbers in an array, which has no part of one. */
function countOf(values, each, name) {
    if (values?.length === undefined) throw new RangeError(`halflight: ${name} is no array`);
    const count = values.length / each;
    if (!Number.isInteger(count)) {
        throw new RangeError(`halflight: ${name} has ${values.length} numbers, and not a multiple of ${each}`);
    }
    return count;
}

/** Texels of a texture in the memory of the module. */
function texelsOf(halflight, { linear, srgb, width, height }, index) {
    const [Type, values, each] = linear ? [Float32Array, linear, 3] : [Uint8Array, srgb, 4];
    if (values?.length !== width * height * each) {
        const [given, wanted] = [values?.length ?? 0, `${width} x ${height} x ${each}`];
        throw new RangeError(`halflight: texture ${index} has ${given} numbers, and not ${wanted}`);
    }
    return halflight.put(Type, values);
}

/** An instance of the module. */
export class Halflight {
    constructor(module, exports) {
        this.module = module;
        this.exports = exports;
        this.blocks = new Blocks(exports.memory);
    }

    /** A scene, ready for pictures and irradiance. Its arrays are copied. */
    scene(description) {
        return new Scene(this, description);
    }

    /** A hierarchy over triangles. */
    bvh(mesh) {
        return new Bvh(this, mesh);
    }

    /** A kd-tree over points x, y, z. */
    points(positions) {
        return new Points(this, positions);
    }

    /** Eigenvalues, three for each symmetric matrix xx, xy, xz, yy, yz, zz, and their unit vectors. */
    eigen3(matrices) {
        const count = countOf(matrices, 6, 'matrices');
        return this.borrowing((take) => {
            const [entries, values, vectors] =
                [take(Float32Array, matrices), take(Float32Array, 3 * count), take(Float32Array, 9 * count)];
            this.check(this.exports.halflight_eigen3(entries, count, values, vectors));
            return {
                values: this.array(Float32Array, values, 3 * count),
                vectors: this.array(Float32Array, vectors, 9 * count),
            };
        });
    }

    view() {
        return new DataView(this.exports.memory.buffer);
    }

    /** A copy of an array of the module. */
    array(Type, at, count) {
        return new Type(this.exports.memory.buffer, at, count).slice();
    }

    /** Memory for `values`: an array, or the number of its elements. */
    put(Type, values) {
        const count = typeof values === 'number' ? values : values.length;
        const at = this.blocks.take(count * Type.BYTES_PER_ELEMENT);
        if (typeof values !== 'number') new Type(this.exports.memory.buffer, at, count).set(values);
        return at;
    }

    /** Runs `work` with memory that is free again at its end. */
    borrowing(work) {
        const taken = [];
        const take = (Type, values) => {
            taken.push(this.put(Type, values));
            return taken[taken.length - 1];
        };
        try {
            return work(take);
        } finally {
            taken.forEach((at) => this.blocks.give(at));
        }
    }

    check(status) {
        if (status === STATUS_OK) return;
        const bytes = new Uint8Array(this.exports.memory.buffer);
        const at = this.exports.halflight_status_text(status);
        throw new RangeError(`halflight: ${new TextDecoder().decode(bytes.subarray(at, bytes.indexOf(0, at)))}`);
    }

    /** Makes an object of `bytes` bytes by `make(memory, bytes, address of the pointer)`. */
    object(bytes, make) {
        const memory = this.blocks.take(bytes);
        try {
            const at = this.borrowing((take) => {
                const pointer = take(Uint32Array, 1);
                this.check(make(memory, bytes, pointer));
                return this.view().getUint32(pointer, true);
            });
            return { memory, at };
        } catch (error) {
            this.blocks.give(memory);
            throw error;
        }
    }

    mesh(take, at, mesh) {
        const { positions, normals, texcoords, triangles, triangleMaterials } = mesh;
        const vertices = countOf(positions, 3, 'positions');
        for (const [values, count, name] of [[normals, 3 * vertices, 'normals'], [texcoords, 2 * vertices, 'texcoords'],
            [triangleMaterials, countOf(triangles, 3, 'triangles'), 'triangleMaterials']]) {
            if (values && values.length > 0 && values.length !== count) {
                throw new RangeError(`halflight: ${name} has ${values.length} numbers, and not ${count}`);
            }
        }
        const optional = (Type, values) => (values && values.length > 0 ? take(Type, values) : 0);
        const pointers = [
            take(Float32Array, positions), optional(Float32Array, normals), optional(Float32Array, texcoords),
            take(Uint32Array, triangles), optional(Uint32Array, triangleMaterials),
        ];
        return new Structure(this.view(), at).u32(
            pointers[0], 0, pointers[1], 0, pointers[2], 0, vertices, pointers[3], 0, pointers[4], triangles.length / 3,
        );
    }
}

/** An object in the memory of the module. */
class Owned {
    constructor(halflight, { memory, at }) {
        Object.assign(this, { halflight, memory, address: at });
    }

    get at() {
        if (!this.address) throw new ReferenceError('halflight: the memory of this object is free');
        return this.address;
    }

    /** Frees the memory: the object must not be used any more. */
    free() {
        this.halflight.blocks.give(this.memory);
        [this.address, this.memory] = [0, undefined];
    }
}

export class Bvh extends Owned {
    constructor(halflight, mesh) {
        super(halflight, halflight.borrowing((take) => {
            const at = take(Uint8Array, MESH_BYTES);
            halflight.mesh(take, at, mesh);
            const bytes = halflight.exports.halflight_bvh_memory(at);
            return halflight.object(bytes, (...place) => halflight.exports.halflight_bvh_build(at, ...place));
        }));
    }

    /** Nearest hits of rays, seven numbers each: origin, largest t, direction. */
    nearest(rays, { coherent = false } = {}) {
        const count = countOf(rays, 7, 'rays');
        return this.halflight.borrowing((take) => {
            const [from, to] = [take(Float32Array, rays), take(Float32Array, 4 * count)];
            this.halflight.check(
                this.halflight.exports.halflight_bvh_nearest(this.at, from, count, coherent ? 1 : 0, to));
            const numbers = this.halflight.array(Float32Array, to, 4 * count);
            const whole = new Uint32Array(numbers.buffer);
            const column = (offset) => Float32Array.from({ length: count }, (_, i) => numbers[4 * i + offset]);
            const triangle = Uint32Array.from({ length: count }, (_, i) => whole[4 * i + 3]);
            return { t: column(0), u: column(1), v: column(2), triangle };
        });
    }

    /** 1 for each ray that hits anything. */
    occluded(rays) {
        const count = countOf(rays, 7, 'rays');
        return this.halflight.borrowing((take) => {
            const [from, to] = [take(Float32Array, rays), take(Uint8Array, count)];
            this.halflight.check(this.halflight.exports.halflight_bvh_occluded(this.at, from, count, to));
            return this.halflight.array(Uint8Array, to, count);
        });
    }
}

export class Points extends Owned {
    constructor(halflight, positions) {
        const count = countOf(positions, 3, 'positions');
        super(halflight, halflight.borrowing((take) => {
            const from = take(Float32Array, positions);
            return halflight.object(halflight.exports.halflight_points_memory(count), (...place) =>
                halflight.exports.halflight_points_build(from, count, 0, ...place));
        }));
    }

    /** The at most `k` nearest points of each place, in rows of `k`, nearest first; `NONE` and infinity at their ends. */
    nearest(places, k, radius = Infinity) {
        const [count, { exports }] = [countOf(places, 3, 'places'), this.halflight];
        return this.halflight.borrowing((take) => {
            const bytes = exports.halflight_nearest_memory(k);
            const [from, work] = [take(Float32Array, places), take(Uint8Array, bytes)];
            const [indices, squared] = [take(Uint32Array, count * k), take(Float32Array, count * k)];
            this.halflight.check(
                exports.halflight_points_nearest(this.at, from, count, k, radius, work, bytes, indices, squared));
            return {
                indices: this.halflight.array(Uint32Array, indices, count * k),
                squaredDistances: this.halflight.array(Float32Array, squared, count * k),
            };
        });
    }
}

export class Scene extends Owned {
    constructor(halflight, description) {
        const textures = [];
        try {
            const given = description.textures ?? [];
            given.forEach((texture, index) => textures.push(texelsOf(halflight, texture, index)));
            super(halflight, halflight.borrowing((take) => {
                const at = take(Uint8Array, MESH_BYTES + 6 * 4 + 12 + 4 + CAMERA_BYTES);
                describe(halflight, take, at, description, textures);
                const bytes = halflight.exports.halflight_scene_memory(at);
                return halflight.object(bytes, (...place) => halflight.exports.halflight_scene_new(at, ...place));
            }));
        } catch (error) {
            textures.forEach((at) => halflight.blocks.give(at));
            throw error;
        }
        Object.assign(this, { textures, description });
    }

    /** A picture in progress. */
    renderer(settings) {
        return new Renderer(this, settings);
    }

    /** Irradiance at points, six numbers each: position and unit normal. Returns arrays of the values of all points. */
    irradiance(points, settings) {
        return this.halflight.borrowing((take) => {
            const [at, count] = this.irradianceIn(take, points, settings);
            const numbers = this.halflight.array(Float32Array, at, 6 * count);
            const whole = new Uint32Array(numbers.buffer);
            const column = (offset) => Float32Array.from({ length: count }, (_, i) => numbers[6 * i + offset]);
            return {
                irradiance: Float32Array.from({ length: 3 * count }, (_, i) =>
                    numbers[6 * Math.floor(i / 3) + (i % 3)]),
                lower: column(3),
                upper: column(4),
                samples: Uint32Array.from({ length: count }, (_, i) => whole[6 * i + 5]),
            };
        });
    }

    /** Values of the irradiance at points in memory of `take`: their address, and their number. */
    irradianceIn(take, points, { samples = 0, error = 0, light = 'all', seed = 0, maxDepth = 0 } = {}) {
        const [{ halflight }, { exports }] = [this, this.halflight];
        const count = countOf(points, 6, 'points');
        const limit = samples === 0 && error === 0 ? 256 : samples;
        const [from, settings] = [take(Float32Array, points), take(Uint8Array, 16)];
        new Structure(halflight.view(), settings)
            .u32(choice(LIGHT_PARTS, light, 'light'), seed, maxDepth).bool(true);
        const { memory, at } = halflight.object(exports.halflight_irradiance_memory(this.at, count, 1),
            (...place) => exports.halflight_irradiance_new(this.at, from, count, settings, 0, ...place));
        try {
            halflight.check(exports.halflight_irradiance_step(at, 0, limit, error));
            const values = take(Float32Array, 6 * count);
            halflight.check(exports.halflight_irradiance_values(at, values, count));
            return [values, count];
        } finally {
            halflight.blocks.give(memory);
        }
    }

    /**
     * Light probes at places x, y, z, from irradiances by 24 normals: coefficients of spherical harmonics of
     * radiance, nine colours for each place in the order of `SphericalHarmonics3` of three.js, half-widths of the
     * 95 % intervals of their luminances, and 1 for each place inside a body.
     */
    probes(places, settings) {
        const [{ halflight }, { exports }] = [this, this.halflight];
        const count = countOf(places, 3, 'places');
        return halflight.borrowing((take) => {
            const at = take(Float32Array, 3 * PROBE_NORMALS);
            halflight.check(exports.halflight_probe_normals(at));
            const normals = halflight.array(Float32Array, at, 3 * PROBE_NORMALS);
            const bundles = Float32Array.from({ length: 6 * PROBE_NORMALS * count }, (_, i) => {
                const [point, k] = [Math.floor(i / 6), i % 6];
                const [place, normal] = [Math.floor(point / PROBE_NORMALS), point % PROBE_NORMALS];
                return k < 3 ? places[3 * place + k] : normals[3 * normal + k - 3];
            });
            const [values] = this.irradianceIn(take, bundles, settings);
            const to = take(Float32Array, 36 * count);
            halflight.check(exports.halflight_probes(values, count, to));
            const numbers = halflight.array(Float32Array, to, 36 * count);
            const part = (first, length) => Float32Array.from({ length: length * count }, (_, i) =>
                numbers[36 * Math.floor(i / length) + first + (i % length)]);
            return { coefficients: part(0, 27), halfWidths: part(27, 9), inside: this.inside(bundles, count) };
        });
    }

    /** 1 for each place from which more than a quarter of its rays first meet the back of a triangle. */
    inside(bundles, count) {
        const { positions, triangles } = this.description;
        const rays = Float32Array.from({ length: (bundles.length / 6) * 7 }, (_, i) => {
            const [ray, k] = [Math.floor(i / 7), i % 7];
            return k === 3 ? Infinity : bundles[6 * ray + (k < 3 ? k : k - 1)];
        });
        const bvh = this.halflight.bvh({ positions, triangles });
        const { triangle } = bvh.nearest(rays);
        bvh.free();
        const isBack = (ray) => {
            if (triangle[ray] === NONE) return false;
            const corner = (i) => positions.subarray(3 * triangles[3 * triangle[ray] + i]);
            const [a, b, c] = [corner(0), corner(1), corner(2)];
            const [u, v] = [b, c].map((other) => [0, 1, 2].map((k) => other[k] - a[k]));
            const normal = [0, 1, 2].map((k) => u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
            return normal.reduce((sum, value, k) => sum + value * bundles[6 * ray + 3 + k], 0) > 0;
        };
        return Uint8Array.from({ length: count }, (_, place) => {
            const all = Array.from({ length: PROBE_NORMALS }, (_, i) => isBack(PROBE_NORMALS * place + i));
            return all.filter(Boolean).length > PROBE_NORMALS / 4 ? 1 : 0;
        });
    }

    free() {
        super.free();
        this.textures.forEach((at) => this.halflight.blocks.give(at));
        this.textures = [];
    }
}

/** Writes the description of a scene at `at`. */
function describe(halflight, take, at, description, texels) {
    const { materials = [{ color: 0.5 }], textures = [], lights = [], camera = {}, environment } = description;
    const index = (texture) => (texture === undefined || texture === null ? 0 : texture + 1);
    const list = (items, bytes) => (items.length > 0 ? take(Uint8Array, items.length * bytes) : 0);
    const [ofMaterials, ofTextures, ofLights] =
        [list(materials, MATERIAL_BYTES), list(textures, TEXTURE_BYTES), list(lights, LIGHT_BYTES)];
    const mesh = halflight.mesh(take, at, description);
    const view = halflight.view();
    materials.forEach((material, i) => {
        new Structure(view, ofMaterials + i * MATERIAL_BYTES)
            .u32(choice(SURFACES, material.surface ?? 'diffuse', 'the surface of a material'))
            .f32(...triple(material.color)).u32(index(material.colorTexture))
            .f32(...triple(material.specular), material.roughness, material.metallic, material.ior)
            .f32(...triple(material.emission)).u32(index(material.emissionTexture))
            .bool(material.emitsOnBothSides).f32(material.transparency);
    });
    textures.forEach(({ linear, width, height, clamps }, i) => {
        new Structure(view, ofTextures + i * TEXTURE_BYTES)
            .u32(linear ? 0 : texels[i], linear ? texels[i] : 0, width, height).bool(clamps);
    });
    lights.forEach((light, i) => {
        new Structure(view, ofLights + i * LIGHT_BYTES)
            .u32(choice(LIGHTS, light.kind, 'the kind of a light'))
            .f32(...triple(light.position), ...triple(light.direction), ...triple(light.power))
            .f32(light.innerDegrees, light.outerDegrees);
    });
    const { eye = [0, 0, 1], target = [0, 0, 0], up = [0, 1, 0], fov = 40, lensRadius = 0, focusDistance = 1 } = camera;
    if (!(fov > 0 && fov <= 178)) throw new RangeError(`halflight: a fov is above 0 and at most 178 degrees, and not ${fov}`);
    new Structure(view, mesh.at)
        .u32(ofMaterials, materials.length, ofTextures, textures.length, ofLights, lights.length)
        .f32(...triple(environment?.radiance ?? environment)).u32(index(environment?.texture))
        .f32(...triple(eye), ...triple(target), ...triple(up), fov, lensRadius, focusDistance);
}

export class Renderer extends Owned {
    constructor(scene, settings) {
        const { halflight } = scene;
        const { width, height, seed = 0, maxDepth = 0, reconstruct = false, shard = 0, shards = 0 } = settings;
        super(halflight, halflight.borrowing((take) => {
            const at = take(Uint8Array, 32);
            // The bits of the module are those of the native program in its precise mode.
            new Structure(halflight.view(), at)
                .u32(width, height, method(settings.method), seed, maxDepth).bool(true).bool(reconstruct)
                .u32(shard, shards);
            const bytes = halflight.exports.halflight_renderer_memory(scene.at, at, 1);
            return halflight.object(bytes, (...place) =>
                halflight.exports.halflight_renderer_new(scene.at, at, 0, ...place));
        }));
        this.size = [width, height];
    }

    /** Adds samples until each pixel has `samples`, or until the error is at most `error`. */
    step({ samples = 0, error = 0 }) {
        this.halflight.check(this.halflight.exports.halflight_renderer_step(this.at, 0, samples, error));
    }

    get samples() {
        return this.halflight.exports.halflight_renderer_samples(this.at);
    }

    get method() {
        return METHODS[this.halflight.exports.halflight_renderer_method(this.at)];
    }

    /** relMSE with the ends of its 95 % interval; `null` as long as it is unknown. */
    error() {
        return this.halflight.borrowing((take) => {
            const at = take(Float64Array, 3);
            if (!this.halflight.exports.halflight_renderer_error(this.at, at)) return null;
            const [relmse, lower, upper] = this.halflight.array(Float64Array, at, 3);
            return { relmse, lower, upper };
        });
    }

    /** Radiance of each pixel, three numbers, row by row from the top. */
    picture() {
        const count = this.size[0] * this.size[1];
        return this.halflight.borrowing((take) => {
            const at = take(Float32Array, 3 * count);
            this.halflight.check(this.halflight.exports.halflight_renderer_picture(this.at, at, count));
            return this.halflight.array(Float32Array, at, 3 * count);
        });
    }

    /** A copy of the film, for `take` of another renderer. */
    film() {
        return this.halflight.borrowing((take) => {
            const bytes = take(Uint32Array, 1);
            const at = this.halflight.exports.halflight_renderer_film(this.at, bytes);
            return this.halflight.array(Uint8Array, at, this.halflight.view().getUint32(bytes, true));
        });
    }

    /** Replaces the tiles of a shard by those of the film of another renderer with that shard. */
    take({ film, shard, shards, samples }) {
        this.halflight.borrowing((take) => {
            const at = take(Uint8Array, film);
            this.halflight.check(
                this.halflight.exports.halflight_renderer_take(this.at, shard, shards, at, film.length, samples));
        });
    }
}

/** Bytes of sRGB for a canvas, from radiance; brighter by `stops`. */
export function toRgba(picture, stops = 0) {
    const factor = 2 ** stops;
    const encode = (linear) => {
        const light = Math.min(1, Math.max(0, linear * factor));
        return Math.round(255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055));
    };
    const bytes = new Uint8ClampedArray((picture.length / 3) * 4);
    for (let pixel = 0; pixel < picture.length / 3; pixel++) {
        for (let channel = 0; channel < 3; channel++) bytes[4 * pixel + channel] = encode(picture[3 * pixel + channel]);
        bytes[4 * pixel + 3] = 255;
    }
    return bytes;
}

/** An OpenEXR file of 32-bit floats, uncompressed, of a picture of radiance. */
export function toExr(picture, width, height) {
    const text = (string) => [...new TextEncoder().encode(string), 0];
    const u32 = (...values) => [...new Uint8Array(new Uint32Array(values).buffer)];
    const f32 = (...values) => [...new Uint8Array(new Float32Array(values).buffer)];
    const attribute = (name, type, bytes) => [...text(name), ...text(type), ...u32(bytes.length), ...bytes];
    const channel = (name) => [...text(name), ...u32(2), 0, 0, 0, 0, ...u32(1, 1)];
    const box = u32(0, 0, width - 1, height - 1);
    const header = [
        ...u32(20000630, 2),
        ...attribute('channels', 'chlist', [...channel('B'), ...channel('G'), ...channel('R'), 0]),
        ...attribute('compression', 'compression', [0]),
        ...attribute('dataWindow', 'box2i', box),
        ...attribute('displayWindow', 'box2i', box),
        ...attribute('lineOrder', 'lineOrder', [0]),
        ...attribute('pixelAspectRatio', 'float', f32(1)),
        ...attribute('screenWindowCenter', 'v2f', f32(0, 0)),
        ...attribute('screenWindowWidth', 'float', f32(1)),
        0,
    ];
    const row = 8 + 12 * width;
    const bytes = new ArrayBuffer(header.length + 8 * height + row * height);
    const view = new DataView(bytes);
    new Uint8Array(bytes).set(header);
    for (let y = 0; y < height; y++) {
        const start = header.length + 8 * height + y * row;
        view.setBigUint64(header.length + 8 * y, BigInt(start), true);
        view.setUint32(start, y, true);
        view.setUint32(start + 4, 12 * width, true);
        for (let plane = 0; plane < 3; plane++) {
            for (let x = 0; x < width; x++) {
                const value = picture[3 * (y * width + x) + 2 - plane];
                view.setFloat32(start + 8 + 4 * (plane * width + x), value, true);
            }
        }
    }
    return new Uint8Array(bytes);
}
