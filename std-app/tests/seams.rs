//! Seams of lightmaps: a floor that is cut in the middle, with its halves turned against each other.

use crate::lightmaps::{GREY, Map, below_the_lamp, folder};

const SIDE: usize = 48;

/// Texture coordinates of the left half of the floor, x from 0 to 1, and of the right one.
fn left([x, z]: [f64; 2]) -> [f64; 2] {
    [0.04 + 0.21 * x, 0.05 + 0.21 * z]
}

fn right([x, z]: [f64; 2]) -> [f64; 2] {
    let ((sin, cos), [x, z]) = (0.5f64.sin_cos(), [0.21 * (x - 1.0), 0.21 * z]);
    [0.62 + x * cos - z * sin, 0.1 + x * sin + z * cos]
}

/// The floor in two charts, a wall at z = 0 in a third one, and a lamp at height 1 over a corner.
fn mesh() -> String {
    let mut mesh = String::new();
    let corners = [[0.0, 2.0], [1.0, 2.0], [1.0, 0.0], [0.0, 0.0]];
    let halves = [(0.0, left as fn([f64; 2]) -> [f64; 2]), (1.0, right)];
    for (offset, unwrap) in halves {
        for [x, z] in corners.map(|[x, z]| [x + offset, z]) {
            let [u, v] = unwrap([x, z]);
            mesh += &format!("v {x} 0 {z}\nvt {u} {v}\n");
        }
    }
    for (x, y) in [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)] {
        mesh += &format!("v {x} {y} 0\nvt {} {}\n", 0.3 + 0.2 * x, 0.8 + 0.15 * y);
    }
    mesh += "usemtl grey\nf 1/1 2/2 3/3 4/4\nf 5/5 6/6 7/7 8/8\nf 9/9 10/10 11/11 12/12\n";
    mesh + "v 0 1 0.5\nv 0 1 0\nv 1 1 0\nv 1 1 0.5\nusemtl lamp\nf 13 14 15 16\n"
}

#[test]
fn fetches_on_both_sides_of_a_cut_agree_within_intervals_that_hold() {
    let folder = folder("seams", &mesh(), GREY);
    let bake = format!("bake scene.obj --lightmap grey --size {SIDE}x{SIDE} --light direct --spp 64");
    folder.object(&format!("{bake} -o map.exr --error-map error.exr --json"));
    let (map, error) = (Map::read(&folder, "map.exr"), Map::read(&folder, "error.exr"));
    let (mut squares, mut sum) = (0.0, 0.0);
    for number in 0..200 {
        let at = [1.0, (f64::from(number) + 0.5) / 100.0];
        let [a, b] = [left(at), right(at)].map(|uv| map.fetch(uv)[0]);
        (squares, sum) = (squares + (a - b) * (a - b), sum + 0.5 * (a + b));
        let truth = below_the_lamp(1.0, at[1]);
        assert!((a - truth).abs() < 0.2 * truth + 0.01, "{at:?}: {a} {truth}");
    }
    let jump = (squares / 200.0).sqrt() / (sum / 200.0);
    assert!(jump < 0.01, "{jump}");
    let (mut held, mut all) = (0, 0);
    for (column, row) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)) {
        let uv = [(column as f64 + 0.5) / SIDE as f64, 1.0 - (row as f64 + 0.5) / SIDE as f64];
        let [x, z] = [(uv[0] - 0.04) / 0.21, (uv[1] - 0.05) / 0.21];
        if (0.0..1.0).contains(&x) && (0.0..2.0).contains(&z) {
            let [value, half] = [&map, &error].map(|map| f64::from(map.texel(column, row)[0]));
            (held, all) = (held + u32::from((value - below_the_lamp(x, z)).abs() <= half), all + 1);
        }
    }
    assert!(all > 150 && f64::from(held) >= 0.93 * f64::from(all), "{held} of {all}");
    // The edge to the wall is no seam: the floor beside it is as bright as it is.
    for x in [0.25, 0.5, 0.75] {
        let (value, truth) = (map.fetch(left([x, 0.03]))[0], below_the_lamp(x, 0.03));
        assert!((value / truth - 1.0).abs() < 0.12, "{x}: {value} {truth}");
    }
}
