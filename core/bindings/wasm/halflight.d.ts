/** Index of no triangle and of no point. */
export const NONE: number;
export type Method =
    | 'auto' | 'path' | 'irradiance-cache' | 'radiance-cache' | 'photon-map' | 'sppm' | 'light' | 'bdpt' | 'vcm'
    | 'instant-radiosity' | 'instant-radiosity-clamped' | 'mlt';
/** Linear sRGB: one number for grey, or three. */
export type Color = number | readonly [number, number, number] | readonly number[];
export type Triple = readonly [number, number, number] | readonly number[];

export interface Mesh {
    /** x, y, z of each vertex. */
    positions: Float32Array;
    /** Unit normals of the vertices, for smooth shading. */
    normals?: Float32Array;
    /** u, v of the vertices, v up. */
    texcoords?: Float32Array;
    /** Three vertices of each triangle, counterclockwise seen from its front. */
    triangles: Uint32Array;
    /** Material of each triangle; without it the first. */
    triangleMaterials?: Uint32Array;
}

export interface Material {
    surface?: 'diffuse' | 'mirror' | 'metal' | 'coated' | 'glass' | 'pane';
    /** Reflectance; black by default. */
    color?: Color;
    /** Index of a texture that multiplies `color`. */
    colorTexture?: number;
    /** Reflectance of a coat at normal incidence. */
    specular?: Color;
    /** Square root of the alpha of GGX, 0 to 1. */
    roughness?: number;
    metallic?: number;
    /** Index of refraction; 1.5 by default. */
    ior?: number;
    /** Emitted radiance, W/(m² sr). */
    emission?: Color;
    emissionTexture?: number;
    emitsOnBothSides?: boolean;
    /** Probability that a ray passes as if there were no surface. */
    transparency?: number;
}

export interface Texture {
    width: number;
    height: number;
    /** RGBA bytes in sRGB, row by row from the top. */
    srgb?: Uint8Array;
    /** RGB floats, linear, in place of `srgb`. */
    linear?: Float32Array;
    clamps?: boolean;
}

export interface Light {
    kind: 'point' | 'spot' | 'directional';
    position?: Triple;
    /** Direction in which the light travels. */
    direction?: Triple;
    /** Intensity in W/sr, or irradiance of a directional light in W/m². */
    power: Color;
    innerDegrees?: number;
    outerDegrees?: number;
}

export interface Camera {
    eye?: Triple;
    target?: Triple;
    up?: Triple;
    /** Vertical field of view in degrees, at most 178. */
    fov?: number;
    lensRadius?: number;
    focusDistance?: number;
}

export interface SceneDescription extends Mesh {
    /** One grey diffuse material by default. */
    materials?: Material[];
    textures?: Texture[];
    lights?: Light[];
    /** Radiance from infinity, with or without a latitude-longitude texture. */
    environment?: Color | { radiance: Color; texture?: number };
    camera?: Camera;
}

export interface Settings {
    width: number;
    height: number;
    /** `auto` by default. */
    method?: Method;
    seed?: number;
    /** Most segments of a path; 0: no limit. */
    maxDepth?: number;
    /** Filters a picture by paths by the surfaces that its pixels see. */
    reconstruct?: boolean;
    /** Part of the picture: every `shards`th tile from tile `shard` on. */
    shard?: number;
    shards?: number;
}

/** relMSE and its 95 % interval. */
export interface ErrorEstimate { relmse: number; lower: number; upper: number }

export interface Hits { t: Float32Array; u: Float32Array; v: Float32Array; triangle: Uint32Array }

export interface IrradianceSettings {
    samples?: number;
    /** Relative half-width at which tiles of near points end. */
    error?: number;
    light?: 'all' | 'direct' | 'indirect';
    seed?: number;
    maxDepth?: number;
}

export interface Irradiance {
    /** Three numbers for each point, W/m². */
    irradiance: Float32Array;
    /** 95 % interval of the luminance of each point. */
    lower: Float32Array;
    upper: Float32Array;
    samples: Uint32Array;
}

export interface Probes {
    /** Spherical harmonics of radiance, nine colours for each place, in the order of `SphericalHarmonics3` of three.js. */
    coefficients: Float32Array;
    /** Half-widths of the 95 % intervals of the luminance of each coefficient. */
    halfWidths: Float32Array;
    /** 1 for each place inside a body. */
    inside: Uint8Array;
}

export function load(source?: string | URL | BufferSource | WebAssembly.Module): Promise<Halflight>;

export class Halflight {
    readonly module: WebAssembly.Module;
    scene(description: SceneDescription): Scene;
    bvh(mesh: Mesh): Bvh;
    points(positions: Float32Array): Points;
    eigen3(matrices: Float32Array): { values: Float32Array; vectors: Float32Array };
}

export class Bvh {
    nearest(rays: Float32Array, options?: { coherent?: boolean }): Hits;
    occluded(rays: Float32Array): Uint8Array;
    free(): void;
}

export class Points {
    nearest(places: Float32Array, k: number, radius?: number): { indices: Uint32Array; squaredDistances: Float32Array };
    free(): void;
}

export class Scene {
    renderer(settings: Settings): Renderer;
    /** Irradiance at points of six numbers each: position and unit normal. */
    irradiance(points: Float32Array, settings?: IrradianceSettings): Irradiance;
    /** Light probes at places x, y, z. */
    probes(places: Float32Array, settings?: IrradianceSettings): Probes;
    free(): void;
}

export class Renderer {
    step(until: { samples?: number; error?: number }): void;
    /** Samples of each pixel. */
    readonly samples: number;
    readonly method: Method;
    error(): ErrorEstimate | null;
    /** Radiance, three numbers for each pixel, row by row from the top. */
    picture(): Float32Array;
    film(): Uint8Array;
    take(part: { film: Uint8Array; shard: number; shards: number; samples: number }): void;
    free(): void;
}

export function toRgba(picture: Float32Array, stops?: number): Uint8ClampedArray;
export function toExr(picture: Float32Array, width: number, height: number): Uint8Array;
