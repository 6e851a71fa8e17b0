// Scenes of three.js: meshes, materials, lights and the camera of a THREE.Scene as the description of a halflight scene.

/** Pixels of a texture of three.js, as bytes of sRGB; `null` where the picture cannot be read. */
function texels(texture) {
    const { image } = texture;
    if (!image || !image.width) return null;
    if (image.data && !(image.data instanceof Float32Array) && image.data.length === 4 * image.width * image.height) {
        return { srgb: new Uint8Array(image.data), width: image.width, height: image.height };
    }
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext('2d');
    try {
        context.drawImage(image, 0, 0);
    } catch {
        return null;
    }
    const { data } = context.getImageData(0, 0, image.width, image.height);
    return { srgb: new Uint8Array(data.buffer), width: image.width, height: image.height };
}

/** Lists of the scene, filled mesh by mesh. */
class Builder {
    constructor() {
        this.positions = [];
        this.normals = [];
        this.texcoords = [];
        this.triangles = [];
        this.triangleMaterials = [];
        this.materials = [];
        this.textures = [];
        this.lights = [];
        this.notes = new Set();
        this.known = new Map();
        this.vertices = 0;
    }

    texture(texture) {
        if (!texture) return undefined;
        if (this.known.has(texture)) return this.known.get(texture);
        const read = texels(texture);
        if (!read) {
            this.notes.add('a texture cannot be read, and is left out');
            return undefined;
        }
        // Rows go from the top; three.js turns pictures over unless `flipY` is false.
        const rows = { ...read, clamps: texture.wrapS === 1001 };
        if (texture.flipY === false) rows.srgb = turned(read);
        const index = this.textures.push(rows) - 1;
        this.known.set(texture, index);
        return index;
    }

    material(material) {
        if (this.known.has(material)) return this.known.get(material);
        const color = material.color ? material.color.toArray() : [0.5, 0.5, 0.5];
        const emission = material.emissive
            ? material.emissive.toArray().map((value) => value * (material.emissiveIntensity ?? 1)) : [0, 0, 0];
        const { roughness = 1, metalness = 0, transmission = 0, ior = 1.5, thickness = 0 } = material;
        const surface = transmission > 0.5 ? (thickness > 0 ? 'glass' : 'pane')
            : metalness > 0.95 ? 'metal' : material.isMeshStandardMaterial && (roughness < 0.95 || metalness > 0.05)
                ? 'coated' : 'diffuse';
        const normal = ((ior - 1) / (ior + 1)) ** 2;
        const index = this.materials.push({
            surface,
            color,
            colorTexture: this.texture(material.map),
            specular: [normal, normal, normal],
            // halflight squares roughness, as three.js does.
            roughness,
            metallic: metalness,
            ior,
            emission,
            emissionTexture: this.texture(material.emissiveMap),
            emitsOnBothSides: material.side === 2,
            transparency: material.transparent ? 1 - material.opacity : 0,
        }) - 1;
        for (const name of ['normalMap', 'roughnessMap', 'metalnessMap', 'alphaMap']) {
            if (material[name]) this.notes.add(`${name} is left out`);
        }
        this.known.set(material, index);
        return index;
    }

    mesh(mesh) {
        const { position, normal, uv } = mesh.geometry.attributes;
        const matrix = mesh.matrixWorld.elements;
        const first = this.vertices;
        const point = (x, y, z, w) => [0, 1, 2].map((row) =>
            matrix[row] * x + matrix[4 + row] * y + matrix[8 + row] * z + matrix[12 + row] * w);
        const cofactors = cofactorsOf(matrix);
        const direction = (x, y, z) => {
            const turned = [0, 1, 2].map((row) =>
                cofactors[3 * row] * x + cofactors[3 * row + 1] * y + cofactors[3 * row + 2] * z);
            const length = Math.hypot(...turned) || 1;
            return turned.map((value) => value / length);
        };
        for (let i = 0; i < position.count; i++) {
            this.positions.push(...point(position.getX(i), position.getY(i), position.getZ(i), 1));
            this.normals.push(...(normal ? direction(normal.getX(i), normal.getY(i), normal.getZ(i)) : [0, 0, 0]));
            this.texcoords.push(...(uv ? [uv.getX(i), uv.getY(i)] : [0, 0]));
        }
        this.vertices += position.count;
        const { index } = mesh.geometry;
        const count = index ? index.count : position.count;
        const at = (i) => first + (index ? index.getX(i) : i);
        const mirrored = mesh.matrixWorld.determinant() < 0;
        const materials = Array.isArray(mesh.material) ? mesh.material : [mesh.material];
        const groups = mesh.geometry.groups.length > 0 && Array.isArray(mesh.material)
            ? mesh.geometry.groups : [{ start: 0, count, materialIndex: 0 }];
        for (const group of groups) {
            const material = this.material(materials[group.materialIndex ?? 0] ?? materials[0]);
            const end = Math.min(count, group.start + group.count);
            for (let i = group.start; i + 2 < end; i += 3) {
                const [a, b, c] = [at(i), at(i + 1), at(i + 2)];
                this.triangles.push(a, ...(mirrored ? [c, b] : [b, c]));
                this.triangleMaterials.push(material);
            }
        }
    }

    light(light) {
        const place = (object) => [12, 13, 14].map((i) => object.matrixWorld.elements[i]);
        const position = place(light);
        // Intensities and emissive colours of three.js have one unit, as those of halflight.
        const power = light.color.toArray().map((value) => value * light.intensity);
        const towards = () => place(light.target).map((value, i) => value - position[i]);
        if (light.isPointLight) {
            this.lights.push({ kind: 'point', position, power });
        } else if (light.isSpotLight) {
            const outerDegrees = (light.angle * 180) / Math.PI;
            const innerDegrees = outerDegrees * (1 - light.penumbra);
            this.lights.push({ kind: 'spot', position, direction: towards(), power, innerDegrees, outerDegrees });
        } else if (light.isDirectionalLight) {
            this.lights.push({ kind: 'directional', direction: towards(), power });
        } else if (light.isAmbientLight || light.isHemisphereLight) {
            this.notes.add(`${light.type} has no place and is left out: light comes back from surfaces here`);
        } else {
            this.notes.add(`${light.type} is left out`);
        }
    }
}

function turned({ srgb, width, height }) {
    const rows = new Uint8Array(srgb.length);
    for (let y = 0; y < height; y++) {
        rows.set(srgb.subarray(4 * width * y, 4 * width * (y + 1)), 4 * width * (height - 1 - y));
    }
    return rows;
}

/** Cofactors of the upper left 3 x 3 of a matrix by columns, row by row: they turn normals. */
function cofactorsOf(m) {
    const [a, d, g, b, e, h, c, f, i] = [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]];
    return [e * i - f * h, f * g - d * i, d * h - e * g, c * h - b * i, a * i - c * g, b * g - a * h,
        b * f - c * e, c * d - a * f, a * e - b * d];
}

/**
 * The description of a scene from a THREE.Scene (or any object of it) and a THREE.PerspectiveCamera. `notes` say what
 * was left out.
 */
export function fromThree(scene, camera) {
    scene.updateMatrixWorld(true);
    const builder = new Builder();
    scene.traverseVisible((object) => {
        if (object.isMesh && object.geometry?.attributes?.position) builder.mesh(object);
        else if (object.isLight) builder.light(object);
    });
    if (builder.triangles.length === 0) throw new RangeError('halflight: the scene has no triangle');
    const background = scene.background?.isColor ? scene.background.toArray() : undefined;
    const hasNormals = builder.normals.some((value) => value !== 0);
    const description = {
        positions: Float32Array.from(builder.positions),
        normals: hasNormals ? Float32Array.from(builder.normals) : undefined,
        texcoords: Float32Array.from(builder.texcoords),
        triangles: Uint32Array.from(builder.triangles),
        triangleMaterials: Uint32Array.from(builder.triangleMaterials),
        materials: builder.materials,
        textures: builder.textures,
        lights: builder.lights,
        environment: background,
        camera: camera ? cameraOf(camera) : framing(builder.positions),
        notes: [...builder.notes],
    };
    return description;
}

function cameraOf(camera) {
    camera.updateMatrixWorld(true);
    const m = camera.matrixWorld.elements;
    const eye = [m[12], m[13], m[14]];
    return {
        eye,
        target: [0, 1, 2].map((i) => eye[i] - m[8 + i]),
        up: [m[4], m[5], m[6]],
        fov: camera.fov,
    };
}

/** A camera that sees all points from the front and a little above. */
export function framing(positions, fov = 40) {
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (let i = 0; i < positions.length; i++) {
        low[i % 3] = Math.min(low[i % 3], positions[i]);
        high[i % 3] = Math.max(high[i % 3], positions[i]);
    }
    const target = low.map((value, i) => (value + high[i]) / 2);
    const radius = Math.hypot(...low.map((value, i) => high[i] - value)) / 2 || 1;
    const distance = radius / Math.sin((fov * Math.PI) / 360);
    const along = [0.35, 0.3, 1].map((value) => value / Math.hypot(0.35, 0.3, 1));
    return { eye: target.map((value, i) => value + distance * along[i]), target, up: [0, 1, 0], fov };
}

/**
 * The light of `probes` at the places of `grid` (`probeGrid` of probes.js) as a `LightProbeGridWebGL` of three.js, to be
 * added to a scene. `THREE` is the module `three` with this class of `three/addons/lighting`.
 */
export function toProbeGrid({ Data3DTexture, DataUtils, HalfFloatType, LinearFilter, LightProbeGridWebGL }, grid, probes) {
    const { size: [width, height, depth], box: [low, high] } = grid;
    const light = new LightProbeGridWebGL(...high.map((value, axis) => value - low[axis]), width, height, depth);
    light.position.set(...low.map((value, axis) => (value + high[axis]) / 2));
    light.updateBoundingBox();
    // Seven volumes of four of the 27 numbers, each between copies of its first and last slice.
    const slices = depth + 2;
    const texels = new Uint16Array(7 * slices * width * height * 4);
    for (let volume = 0; volume < 7; volume++) {
        for (let slice = 0; slice < slices; slice++) {
            const z = Math.min(Math.max(slice - 1, 0), depth - 1);
            for (let cell = 0; cell < width * height; cell++) {
                const first = 4 * (cell + width * height * (slice + slices * volume));
                for (let i = 0; i < 4 && 4 * volume + i < 27; i++) {
                    const value = probes.coefficients[27 * (cell + width * height * z) + 4 * volume + i];
                    texels[first + i] = DataUtils.toHalfFloat(Math.min(Math.max(value, -65504), 65504));
                }
            }
        }
    }
    const texture = new Data3DTexture(texels, width, height, 7 * slices);
    Object.assign(texture, { type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter, needsUpdate: true });
    light.texture = texture;
    return light;
}
