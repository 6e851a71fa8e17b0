//! Picture of the floor of the box between records of two metrics: errors from white to red, records as black
//! dots, blocks in grey.

use super::metrics::{Buffers, Placed, RULES, Tables, candidates, of_count, point};
use super::rooms::Room;
use glam::{DVec3, Vec3Swizzles};
use halflight::save::Image;
use halflight_core::memory::OutOfMemory;
use halflight_test_support::Random;

/// Records of each panel.
const RECORDS: usize = 150;
/// Points of a panel along a side, pixels of a point, and pixels between panels.
const SIDE: usize = 64;
const PIXELS: usize = 4;
const GAP: usize = 8;
/// Relative error that is red.
const MOST: f64 = 0.1;

const GREY: [f32; 3] = [0.3; 3];

/// Panels of split-sphere and of the larger Hessian.
pub(super) fn picture() -> Result<Image, OutOfMemory> {
    let mut buffers = Buffers::new()?;
    let tables = Tables::new(&mut buffers)?;
    let [room, ..] = Room::all();
    let mut random = Random(41);
    let candidates = candidates(&tables, &room, &mut random);
    let at = |k: usize| (k as f64 + 0.5) / SIDE as f64;
    let mut points = Vec::new();
    for cell in 0..SIDE * SIDE {
        let from = DVec3::new(at(cell % SIDE), at(cell / SIDE), 0.0);
        points.push(if room.is_free(from) { point(&tables, &room, from, &mut random) } else { None });
    }
    let side = SIDE * PIXELS;
    let width = 2 * side + GAP;
    let mut pixels = vec![[1.0; 3]; width * side];
    for (panel, rule) in [RULES[0], RULES[4]].into_iter().enumerate() {
        let placed = of_count(rule.2, room.extent() as f32, RECORDS, candidates.iter());
        let left = panel * (side + GAP);
        for (cell, point) in points.iter().enumerate() {
            let colour = point.as_ref().map_or(GREY, |point| {
                let error = (f64::from(placed.at(0, point)) / point.exact - 1.0).abs() / MOST;
                let rest = (1.0 - error.min(1.0)) as f32;
                [1.0, rest, rest]
            });
            // The far side is on top.
            let (column, row) = (left + cell % SIDE * PIXELS, (SIDE - 1 - cell / SIDE) * PIXELS);
            for pixel in 0..PIXELS * PIXELS {
                pixels[(row + pixel / PIXELS) * width + column + pixel % PIXELS] = colour;
            }
        }
        dots(&placed, (&mut pixels, width), (left, side));
    }
    Ok(Image { width: width as u32, height: side as u32, pixels })
}

/// Dots of three pixels at the records of a panel.
fn dots(placed: &Placed, (pixels, width): (&mut [[f32; 3]], usize), (left, side): (usize, usize)) {
    for position in placed.positions() {
        let [x, y] = position.xy().to_array().map(|at| (at * side as f32) as usize);
        for offset in 0..9 {
            let (column, row) =
                ((x + offset % 3).max(1) - 1, (side - 1 - y.min(side - 1) + offset / 3).max(1) - 1);
            if column < side && row < side {
                pixels[row * width + left + column] = [0.0; 3];
            }
        }
    }
}
