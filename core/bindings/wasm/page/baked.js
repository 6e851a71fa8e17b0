// Light that is baked by halflight and shown by three.js: irradiance of vertices, and a grid of probes.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { fillProbes, probeGrid } from '../probes.js';
import { framing, toProbeGrid } from '../three.js';

/** Irradiance of all vertices as their colours: radiance of a surface is albedo × irradiance / π. */
export async function bakeVertices({ positions, normals, triangles, triangleMaterials, materials }, pool, settings) {
    // Vertices without normals have those of a triangle.
    const count = positions.length / 3;
    const normal = Float32Array.from({ length: positions.length }, (_, i) => normals?.[i] ?? 0);
    for (let i = 0; i < triangles.length && !normals; i += 3) {
        const [a, b, c] = [0, 1, 2].map((k) => new THREE.Vector3().fromArray(positions, 3 * triangles[i + k]));
        const n = b.sub(a).cross(c.sub(a)).normalize().toArray();
        for (let k = 0; k < 3; k++) normal.set(n, 3 * triangles[i + k]);
    }
    const points = Float32Array.from({ length: 6 * count }, (_, i) => {
        const [vertex, k] = [Math.floor(i / 6), i % 6];
        return k < 3 ? positions[3 * vertex + k] : normal[3 * vertex + k - 3];
    });
    const baked = await pool.irradiance(points, settings);
    const { irradiance, lower, upper, samples } = baked;
    const geometry = new THREE.BufferGeometry();
    const [corners, colors] = [[], []];
    for (let i = 0; i < triangles.length; i++) {
        const { color, emission } = materials[triangleMaterials[Math.floor(i / 3)]];
        const vertex = triangles[i];
        corners.push(...positions.slice(3 * vertex, 3 * vertex + 3));
        for (let k = 0; k < 3; k++) colors.push(emission[k] + (color[k] * irradiance[3 * vertex + k]) / Math.PI);
    }
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(corners, 3));
    geometry.setAttribute('color', new THREE.Float32BufferAttribute(colors, 3));
    const scene = new THREE.Scene();
    scene.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide })));
    const widths = Array.from(lower, (low, i) => (upper[i] - low) / Math.max(upper[i] + low, 1e-9)).sort((a, b) => a - b);
    const half = (100 * widths[count >> 1]).toFixed(1);
    const number = count.toLocaleString('en');
    const text = `${number} vertices with ${samples[0]} samples each; median half-width of the 95 % intervals ${half} %`;
    return { baked, scene, text };
}

/** Numbers of probes of a box: about `most` in cells that are nearly cubes. */
function sizeOf([low, high], most) {
    const sides = high.map((value, axis) => Math.max(value - low[axis], 1e-6));
    const cell = Math.cbrt((sides[0] * sides[1] * sides[2]) / most);
    return sides.map((side) => Math.min(Math.max(Math.round(side / cell), 2), 32));
}

/** A grid of probes that lights the scene, and a white ball in it. Lamps of three.js are left out: probes have their light. */
export async function bakeProbes(description, pool, { most = 216, ...settings }) {
    const { box } = probeGrid(description, [1, 1, 1]);
    const grid = probeGrid(description, sizeOf(box, most), box);
    const baked = { grid, ...await pool.probes(grid.places, settings) };
    fillProbes(grid, baked);
    const scene = new THREE.Scene();
    const object = description.object.clone();
    const lights = [];
    object.traverse((part) => { if (part.isLight) lights.push(part); });
    lights.forEach((light) => light.removeFromParent());
    const radius = Math.hypot(...box[1].map((value, axis) => value - box[0][axis])) / 20;
    const ball = new THREE.Mesh(new THREE.SphereGeometry(radius, 48, 32), new THREE.MeshLambertMaterial({ color: '#ffffff' }));
    ball.name = 'ball';
    ball.position.set(...box[0].map((value, axis) => (value + box[1][axis]) / 2));
    scene.add(object, ball, toProbeGrid({ ...THREE, LightProbeGridWebGL }, grid, baked));
    const hidden = baked.inside.reduce((sum, value) => sum + value, 0);
    const text = `${grid.size.join(' × ')} probes, ${hidden} of them inside bodies. A click moves the white ball.`;
    return { baked, scene, text };
}

/** A canvas with a scene of three.js to look around in. */
export class View {
    constructor(canvas) {
        this.canvas = canvas;
        this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
        this.camera = new THREE.PerspectiveCamera();
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.addEventListener('change', () => this.draw());
        canvas.addEventListener('click', (event) => this.moveBall(event));
    }

    show(scene, { camera, positions }, [width, height]) {
        const { eye, target, fov } = camera ?? framing(positions);
        this.scene = scene;
        this.renderer.setSize(width, height, false);
        Object.assign(this.camera, { fov, aspect: width / height, near: 0.01, far: 1e5 });
        this.camera.position.set(...eye);
        this.camera.updateProjectionMatrix();
        this.controls.target.set(...target);
        this.controls.update();
        this.draw();
    }

    draw() {
        this.renderer.render(this.scene, this.camera);
    }

    /** Puts the ball of the scene on the surface below the pointer. */
    moveBall({ offsetX, offsetY }) {
        const ball = this.scene?.getObjectByName('ball');
        if (!ball) return;
        const ray = new THREE.Raycaster();
        const { clientWidth, clientHeight } = this.canvas;
        ray.setFromCamera(new THREE.Vector2((2 * offsetX) / clientWidth - 1, 1 - (2 * offsetY) / clientHeight), this.camera);
        const [hit] = ray.intersectObjects(this.scene.children.filter((child) => child !== ball && !child.isLight));
        if (!hit) return;
        const normal = hit.face.normal.clone().transformDirection(hit.object.matrixWorld);
        if (normal.dot(ray.ray.direction) > 0) normal.negate();
        ball.position.copy(hit.point).addScaledVector(normal, ball.geometry.parameters.radius);
        this.draw();
    }
}
