// A worker with an instance of its own: it renders one shard of a picture, or joins the films of all shards.
import { load } from './halflight.js';

let scene;
let renderer;

const answers = {
    async open({ module, description }) {
        scene = (await load(module)).scene(description);
    },

    renderer({ settings }) {
        renderer?.free();
        renderer = scene.renderer(settings);
        return { method: renderer.method };
    },

    /** Samples of this shard, and its film. */
    step({ samples }) {
        renderer.step({ samples });
        const film = renderer.film();
        return { film, samples: renderer.samples, transfer: [film.buffer] };
    },

    /** Adds samples to the whole picture, of a method that one instance has to render. */
    whole({ samples }) {
        renderer.step({ samples });
        return answers.judged();
    },

    /** The picture and its error by the films of all shards. */
    join({ films }) {
        films.forEach((film) => renderer.take(film));
        renderer.step({ samples: 0 });
        return answers.judged();
    },

    judged() {
        const picture = renderer.picture();
        return { picture, error: renderer.error(), samples: renderer.samples, transfer: [picture.buffer] };
    },

    irradiance({ items, settings }) {
        return scene.irradiance(items, settings);
    },

    probes({ items, settings }) {
        return scene.probes(items, settings);
    },
};

self.onmessage = async ({ data: { id, name, argument } }) => {
    try {
        const { transfer = [], ...result } = (await answers[name](argument)) ?? {};
        self.postMessage({ id, result }, transfer);
    } catch (error) {
        self.postMessage({ id, error: String(error?.message ?? error) });
    }
};
