// Grids of light probes: their places, and the light of probes inside bodies from their neighbours.

/**
 * Places of `size` probes along x, y and z, at the centres of the cells of `box`, of its lowest and highest corner; by
 * default of the mesh. Cells along x come first, then along y, then along z.
 */
export function probeGrid({ positions }, size, box = bounds(positions)) {
    const [low, high] = box;
    const places = Float32Array.from({ length: 3 * size[0] * size[1] * size[2] }, (_, i) => {
        const [cell, axis] = [Math.floor(i / 3), i % 3];
        const along = [cell % size[0], Math.floor(cell / size[0]) % size[1], Math.floor(cell / (size[0] * size[1]))];
        return low[axis] + ((along[axis] + 0.5) / size[axis]) * (high[axis] - low[axis]);
    });
    return { size: [...size], box: [[...low], [...high]], places };
}

function bounds(positions) {
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (let i = 0; i < positions.length; i++) {
        low[i % 3] = Math.min(low[i % 3], positions[i]);
        high[i % 3] = Math.max(high[i % 3], positions[i]);
    }
    return [low, high];
}

/** Gives probes inside bodies the mean light of the probes around, ring by ring; all are kept if all are inside. */
export function fillProbes({ size }, { coefficients, halfWidths, inside }) {
    const [width, height, depth] = size;
    const known = inside.map((value) => 1 - value);
    if (!known.includes(1)) return;
    const around = (cell) => {
        const place = [cell % width, Math.floor(cell / width) % height, Math.floor(cell / (width * height))];
        return Array.from({ length: 27 }, (_, i) => [i % 3, Math.floor(i / 3) % 3, Math.floor(i / 9)]
            .map((step, axis) => place[axis] + step - 1))
            .filter(([x, y, z]) => x >= 0 && y >= 0 && z >= 0 && x < width && y < height && z < depth)
            .map(([x, y, z]) => x + width * (y + height * z)).filter((other) => known[other]);
    };
    while (known.includes(0)) {
        const ring = Array.from(known.keys()).filter((cell) => !known[cell]).map((cell) => [cell, around(cell)])
            .filter(([, from]) => from.length > 0);
        for (const [cell, from] of ring) {
            for (const [values, each] of [[coefficients, 27], [halfWidths, 9]]) {
                for (let i = 0; i < each; i++) {
                    values[each * cell + i] = from.reduce((sum, other) => sum + values[each * other + i], 0) / from.length;
                }
            }
        }
        ring.forEach(([cell]) => { known[cell] = 1; });
    }
}
