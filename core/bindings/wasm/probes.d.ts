import type { Probes, Triple } from './halflight.js';

export interface ProbeGrid {
    /** Numbers of probes along x, y and z. */
    size: [number, number, number];
    /** Lowest and highest corner. */
    box: [Triple, Triple];
    /** x, y, z of each probe. */
    places: Float32Array;
}

export function probeGrid(
    mesh: { positions: Float32Array }, size: readonly [number, number, number], box?: [Triple, Triple],
): ProbeGrid;
/** Gives probes inside bodies the light of their neighbours. */
export function fillProbes(grid: ProbeGrid, probes: Probes): void;
