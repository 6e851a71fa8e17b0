// The page: a scene from files, its picture and error while it renders, and bakes of its light.
import * as THREE from 'three';
import { toExr, toRgba } from '../halflight.js';
import { Pool } from '../pool.js';
import { fromThree } from '../three.js';
import { View, bakeProbes, bakeVertices } from './baked.js';

const element = (id) => document.getElementById(id);
const page = { description: box(), object: null, pool: null, stop: null, state: null, curve: [], gate: null };

/** A white box, open in front, with a lamp below its ceiling and two blocks. */
function box() {
    const scene = new THREE.Scene();
    const grey = (color) => new THREE.MeshStandardMaterial({ color, side: THREE.DoubleSide, roughness: 1 });
    const plane = (color, size, position, rotation) => {
        const mesh = new THREE.Mesh(new THREE.PlaneGeometry(...size, 12, 12), grey(color));
        mesh.position.set(...position);
        mesh.rotation.set(...rotation);
        scene.add(mesh);
        return mesh;
    };
    plane('#bbbbbb', [2, 2], [0, -1, 0], [-Math.PI / 2, 0, 0]);
    plane('#bbbbbb', [2, 2], [0, 1, 0], [Math.PI / 2, 0, 0]);
    plane('#bbbbbb', [2, 2], [0, 0, -1], [0, 0, 0]);
    plane('#a03020', [2, 2], [-1, 0, 0], [0, Math.PI / 2, 0]);
    plane('#308040', [2, 2], [1, 0, 0], [0, -Math.PI / 2, 0]);
    const lamp = plane('#000000', [0.6, 0.6], [0, 0.98, 0], [Math.PI / 2, 0, 0]);
    lamp.material = new THREE.MeshStandardMaterial({ color: 0, emissive: '#ffe2c0', emissiveIntensity: 14 });
    for (const [size, position, angle] of [[[0.6, 1.2, 0.6], [-0.35, -0.4, -0.3], 0.3], [[0.6, 0.6, 0.6], [0.4, -0.7, 0.3], -0.3]]) {
        const block = new THREE.Mesh(new THREE.BoxGeometry(...size, 6, 6, 6), grey('#bbbbbb'));
        block.position.set(...position);
        block.rotation.y = angle;
        scene.add(block);
    }
    const camera = new THREE.PerspectiveCamera(39, 4 / 3);
    camera.position.set(0, 0, 3.9);
    return { ...fromThree(scene, camera), object: scene };
}

function say(text) {
    element('state').textContent = text;
}

/** Opens the files that were chosen or dropped. */
async function open(files) {
    const named = (ending) => files.find((file) => file.name.toLowerCase().endsWith(ending));
    const addresses = new Map(files.map((file) => [file.name, URL.createObjectURL(file)]));
    const manager = new THREE.LoadingManager();
    manager.setURLModifier((url) => addresses.get(decodeURIComponent(url.split('/').pop())) ?? url);
    const loaded = new Promise((resolve) => { manager.onLoad = resolve; });
    let object;
    let camera;
    const gltf = named('.glb') ?? named('.gltf');
    const obj = named('.obj');
    if (gltf) {
        const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
        const result = await new GLTFLoader(manager).loadAsync(addresses.get(gltf.name));
        [object, camera] = [result.scene, result.cameras.find((one) => one.isPerspectiveCamera)];
    } else if (obj) {
        const { OBJLoader } = await import('three/addons/loaders/OBJLoader.js');
        const loader = new OBJLoader(manager);
        const mtl = named('.mtl');
        if (mtl) {
            const { MTLLoader } = await import('three/addons/loaders/MTLLoader.js');
            const materials = await new MTLLoader(manager).loadAsync(addresses.get(mtl.name));
            materials.preload();
            loader.setMaterials(materials);
        }
        object = await loader.loadAsync(addresses.get(obj.name));
        if (mtl) await Promise.race([loaded, new Promise((resolve) => setTimeout(resolve, 3000))]);
    } else {
        throw new Error('no .obj, .glb or .gltf is among these files');
    }
    page.description = { ...fromThree(object, camera), object };
    const emits = page.description.materials.some(({ emission }) => emission.some((value) => value > 0));
    if (!emits && page.description.lights.length === 0 && !page.description.environment) {
        page.description.environment = [1, 1, 1];
        page.description.notes.push('nothing in the scene emits light: it has a white sky here');
    }
    page.pool?.close();
    page.pool = null;
    element('notes').replaceChildren(...page.description.notes.map((note) => {
        const item = document.createElement('li');
        item.textContent = note;
        return item;
    }));
    say(`${(page.description.triangles.length / 3).toLocaleString('en')} triangles wait to be rendered.`);
}

async function pool() {
    const { object, notes, ...description } = page.description;
    page.pool ??= await Pool.open(description);
    return page.pool;
}

function draw() {
    const { picture, size } = page.state ?? {};
    if (!picture) return;
    const canvas = element('picture');
    [canvas.width, canvas.height] = size;
    const rgba = toRgba(picture, Number(element('stops').value));
    canvas.getContext('2d').putImageData(new ImageData(rgba, ...size), 0, 0);
}

/** Draws the error against time, with its interval. */
function drawCurve() {
    const known = page.curve.filter(({ error }) => error && error.lower > 0);
    if (known.length < 2) return element('curve').replaceChildren();
    const log = Math.log10;
    const seconds = known.map((point) => log(point.seconds));
    const [first, last] = [Math.min(...seconds), Math.max(...seconds)];
    const [low, high] = [Math.min(...known.map(({ error }) => log(error.lower))), Math.max(...known.map(({ error }) => log(error.upper)))];
    const x = (point) => 10 + (300 * (log(point.seconds) - first)) / Math.max(last - first, 1e-6);
    const y = (value) => 110 - (100 * (log(value) - low)) / Math.max(high - low, 1e-6);
    const line = (name) => known.map((point) => `${x(point).toFixed(1)},${y(point.error[name]).toFixed(1)}`);
    const shape = (kind, name, points) => {
        const made = document.createElementNS('http://www.w3.org/2000/svg', kind);
        made.setAttribute('class', name);
        made.setAttribute('points', points.join(' '));
        return made;
    };
    element('curve').replaceChildren(
        shape('polygon', 'band', [...line('lower'), ...line('upper').reverse()]),
        shape('polyline', 'line', line('relmse')),
    );
}

async function render(until = {}) {
    page.stop?.abort();
    proceed();
    const stop = new AbortController();
    page.stop = stop;
    page.curve = [];
    element('picture').hidden = false;
    element('baked').hidden = true;
    const size = ['width', 'height'].map((id) => Math.min(4096, Math.max(16, Math.round(Number(element(id).value) || 16))));
    const settings = {
        width: size[0], height: size[1], method: element('method').value, reconstruct: element('reconstruct').checked,
    };
    say('The structures of the scene are being built.');
    const workers = await pool();
    element('pause').disabled = false;
    const show = (state) => {
        page.state = { ...state, size };
        page.curve.push({ seconds: state.seconds, error: state.error });
        draw();
        drawCurve();
        const error = state.error
            ? `relMSE ${state.error.relmse.toExponential(1)} (95 %: ${state.error.lower.toExponential(1)} to ${state.error.upper.toExponential(1)})`
            : 'the error is unknown yet';
        say(`${state.samples} samples per pixel by ${state.method} in ${state.seconds.toFixed(1)} s; ${error}`);
        for (const id of ['png', 'exr']) element(id).disabled = false;
        return page.gate?.promise;
    };
    await workers.render(settings, { error: 1e-4, ...until, signal: stop.signal, onProgress: show });
    if (page.stop === stop) element('pause').disabled = true;
}

/** Ends a pause. */
function proceed() {
    page.gate?.open();
    page.gate = null;
    element('pause').textContent = 'Pause';
}

function save(name, blob) {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Bakes the vertices or a grid of probes, and shows them by three.js. */
async function bake(kind, settings = {}) {
    page.stop?.abort();
    proceed();
    say('Irradiance is being estimated.');
    const { baked, scene, text } = await kind(page.description, await pool(), { samples: 256, ...settings });
    element('picture').hidden = true;
    element('baked').hidden = false;
    page.view ??= new View(element('baked'));
    page.view.show(scene, page.description, ['width', 'height'].map((id) => Number(element(id).value)));
    say(text);
    return baked;
}

/** Runs work of a button, and shows its failure. */
const acting = (work) => () => Promise.resolve(work()).catch((error) => say(`This did not work: ${error.message ?? error}`));

element('render').onclick = acting(() => render());
element('vertices').onclick = acting(() => bake(bakeVertices));
element('probes').onclick = acting(() => bake(bakeProbes));
element('pause').onclick = () => {
    if (page.gate) return proceed();
    page.gate = {};
    page.gate.promise = new Promise((resolve) => { page.gate.open = resolve; });
    element('pause').textContent = 'Continue';
};
element('stops').oninput = draw;
element('png').onclick = () => element('picture').toBlob((blob) => save('halflight.png', blob));
element('exr').onclick = () => save('halflight.exr', new Blob([toExr(page.state.picture, ...page.state.size)]));
element('files').onchange = acting(async () => {
    await open([...element('files').files]);
    await render();
});
document.body.ondragover = (event) => {
    event.preventDefault();
    document.body.classList.add('drop');
};
document.body.ondragleave = () => document.body.classList.remove('drop');
document.body.ondrop = (event) => {
    event.preventDefault();
    document.body.classList.remove('drop');
    acting(async () => {
        await open([...event.dataTransfer.files]);
        await render();
    })();
};

// For tests and for the console.
Object.assign(window, { halflight: { page, render, bake, bakeProbes, bakeVertices, open } });
document.documentElement.dataset.ready = 'true';
