// Pictures by a worker for each core. No shared memory: workers send the films of their shards.
import { load } from './halflight.js';

/** Methods whose films can be joined: their pixels share no structure. */
const DIVISIBLE = ['path'];

/** A worker, and its answers as promises. */
class Remote {
    constructor() {
        this.worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
        this.waiting = new Map();
        this.next = 0;
        this.worker.onmessage = ({ data: { id, result, error } }) => {
            const { resolve, reject } = this.waiting.get(id);
            this.waiting.delete(id);
            if (error === undefined) resolve(result);
            else reject(new Error(error));
        };
        this.worker.onerror = (event) => {
            this.waiting.forEach(({ reject }) => reject(new Error(event.message ?? 'a worker has failed')));
            this.waiting.clear();
        };
    }

    call(name, argument, transfer = []) {
        return new Promise((resolve, reject) => {
            this.waiting.set(this.next, { resolve, reject });
            this.worker.postMessage({ id: this.next++, name, argument }, transfer);
        });
    }
}

/** Workers that hold one scene. */
export class Pool {
    /** Opens `description` in `count` workers, and in one that joins their films. */
    static async open(description, { count = navigator.hardwareConcurrency || 2, source } = {}) {
        const { module } = await load(source);
        const pool = new Pool();
        pool.workers = Array.from({ length: Math.max(1, count) }, () => new Remote());
        pool.judge = new Remote();
        try {
            await Promise.all([...pool.workers, pool.judge].map((remote) => remote.call('open', { module, description })));
        } catch (error) {
            pool.close();
            throw error;
        }
        return pool;
    }

    /**
     * Renders until `samples` or `error`, whichever is first, or until `signal` aborts. `onProgress` gets
     * `{ picture, error, samples, method, seconds }` after each round, which waits for a promise that it returns; the
     * result is the last one.
     */
    async render(settings, { samples = Infinity, error = 0, signal, onProgress = () => {} } = {}) {
        const start = performance.now();
        const divided = DIVISIBLE.includes(settings.method);
        const shards = divided ? Math.min(this.workers.length, tiles(settings)) : 1;
        const workers = divided ? this.workers.slice(0, shards) : [];
        const { method } = await this.judge.call('renderer', { settings });
        await Promise.all(workers.map((worker, shard) =>
            worker.call('renderer', { settings: { ...settings, shard, shards } })));
        let state = { picture: null, error: null, samples: 0 };
        while (!signal?.aborted && state.samples < samples) {
            // Rounds double, so that the first picture comes at once, up to half a second each.
            const elapsed = performance.now() - start;
            const each = elapsed / Math.max(1, state.samples);
            const more = Math.max(1, Math.min(state.samples || 1, Math.floor(500 / Math.max(each, 1e-3))));
            const target = Math.min(samples, state.samples + more);
            if (divided) {
                const parts = await Promise.all(workers.map((worker) => worker.call('step', { samples: target })));
                const films = parts.map((part, shard) => ({ ...part, shard, shards }));
                state = await this.judge.call('join', { films }, films.map(({ film }) => film.buffer));
            } else {
                state = await this.judge.call('whole', { samples: target });
            }
            await onProgress({ ...state, method, seconds: (performance.now() - start) / 1000 });
            if (error > 0 && state.error && state.error.upper <= error && state.samples >= 16) break;
        }
        return { ...state, method, seconds: (performance.now() - start) / 1000 };
    }

    /** Irradiance at points as by `Scene.irradiance`, divided among the workers. */
    irradiance(points, settings) {
        return this.divided('irradiance', points, 6, settings);
    }

    /** Light probes at places as by `Scene.probes`, divided among the workers. */
    probes(places, settings) {
        return this.divided('probes', places, 3, settings);
    }

    /** Arrays for items of `size` numbers, of which each worker gets a part. */
    async divided(name, items, size, settings) {
        const each = size * Math.ceil(items.length / size / this.workers.length);
        const parts = await Promise.all(this.workers.map((worker, i) => {
            const part = items.slice(i * each, (i + 1) * each);
            return part.length > 0 || i === 0 ? worker.call(name, { items: part, settings }) : null;
        }));
        const [first, ...others] = parts.filter(Boolean);
        const joined = (key) => [first, ...others].flatMap((part) => [...part[key]]);
        return Object.fromEntries(Object.keys(first).map((key) => [key, first[key].constructor.from(joined(key))]));
    }

    /** Ends the workers. */
    close() {
        [...this.workers, this.judge].forEach(({ worker }) => worker.terminate());
    }
}

function tiles({ width, height }) {
    return Math.ceil(width / 16) * Math.ceil(height / 16);
}
