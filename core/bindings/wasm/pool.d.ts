import type {
    ErrorEstimate, Irradiance, IrradianceSettings, Method, Probes, SceneDescription, Settings,
} from './halflight.js';

export interface State {
    picture: Float32Array | null;
    error: ErrorEstimate | null;
    samples: number;
    method: Method;
    seconds: number;
}

export class Pool {
    static open(
        description: SceneDescription,
        options?: { count?: number; source?: string | URL | BufferSource | WebAssembly.Module },
    ): Promise<Pool>;
    render(
        settings: Settings,
        options?: { samples?: number; error?: number; signal?: AbortSignal; onProgress?: (state: State) => void | Promise<void> },
    ): Promise<State>;
    irradiance(points: Float32Array, settings?: IrradianceSettings): Promise<Irradiance>;
    probes(places: Float32Array, settings?: IrradianceSettings): Promise<Probes>;
    close(): void;
}
