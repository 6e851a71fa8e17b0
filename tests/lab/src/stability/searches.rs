//! Kernels with exact answers: rays against boxes in f64, photon searches against brute force.

use super::Table;
use glam::{DVec3, Vec3};
use halflight::pages::Pages;
use halflight_core::memory::Arena;
use halflight_core::photon::{Neighbours, Photon, PhotonMap, Photons, brute};
use halflight_core::sampling::Random;
use halflight_core::{Level, Rgb};
use halflight_simd::kernels::boxes::{Boxes8, SlabRay, SlabRay8};
use halflight_simd::{Kernel, Simd};

pub(super) fn cases(table: &mut Table) {
    for (case, size, thickness, direction) in [
        ("boxes of a millionth", 1e-6, 1.0, [1.0, 1.0, 1.0]),
        ("boxes of a million", 1e6, 1.0, [1.0, 1.0, 1.0]),
        ("flat boxes", 1.0, 0.0, [1.0, 1.0, 1.0]),
        ("rays along an axis", 1.0, 1.0, [1.0, 0.0, -0.0]),
        ("directions of 1e-30", 1.0, 1.0, [1.0, 1e-30, 1e-20]),
    ] {
        boxes(table, case, size, thickness, Vec3::from_array(direction));
    }
    photons(table);
}

/// Test of a ray against eight boxes.
struct Eight<'a>(&'a SlabRay, &'a Boxes8);

impl Kernel for Eight<'_> {
    type Out = u32;
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> u32 {
        SlabRay8::new(simd, self.0).enters(simd, self.1, f32::MAX).1
    }
}

/// Rays towards points in boxes: no box may be missed at any level. `thickness` 0 makes boxes flat along z.
fn boxes(table: &mut Table, case: &str, size: f32, thickness: f32, stretch: Vec3) {
    let (mut hits, mut missed) = (0, 0);
    const BATCHES: u32 = 1024;
    let random = Random::new(6, 0);
    for batch in 0..BATCHES {
        let draw = |i: u32, k: u32| random.single((batch * 8 + i) * 16 + k);
        let point = |i: u32, k: u32| Vec3::new(draw(i, k), draw(i, k + 1), draw(i, k + 2));
        let signs = (2.0 * point(0, 12) - Vec3::ONE).map(f32::signum);
        let direction = (point(0, 0) + Vec3::splat(0.1)) * stretch * signs;
        let mut planes: Boxes8 = [[0.0; 8]; 8];
        let origin = size * (10.0 * point(0, 3) - Vec3::splat(5.0));
        for i in 0..8 {
            // A point of the ray in f32, in a box with room for its rounding.
            let along = direction.as_dvec3() * (f64::from(size) * f64::from(2.0 * draw(i, 6)));
            let at = origin.as_dvec3() + along;
            let room = f64::from(size) * (1e-6 * 16.0);
            for axis in 0..3 {
                let thick = if axis == 2 { thickness } else { 1.0 };
                let extent = |k| f64::from(thick) * (room + f64::from(size * draw(i, k)));
                planes[2 * axis][i as usize] = (at[axis] - extent(7)) as f32;
                planes[2 * axis + 1][i as usize] = (at[axis] + extent(8)) as f32;
            }
        }
        let ray = SlabRay::new(origin.to_array(), direction.to_array());
        for level in [Level::BASELINE, Level::detect()] {
            let entered = level.dispatch(Eight(&ray, &planes));
            for i in 0..8u32 {
                let exact = enters(&planes, i as usize, origin.as_dvec3(), direction.as_dvec3());
                let found = entered >> i & 1 == 1 && ray.enters(&planes, i as usize, f32::MAX).is_some();
                hits += u32::from(exact);
                missed += u32::from(exact && !found);
            }
        }
    }
    table.exact(format!("rays and boxes, {case}: none is missed"), missed, hits);
}

/// Slab test in f64.
fn enters(boxes: &Boxes8, i: usize, origin: DVec3, direction: DVec3) -> bool {
    let (mut entry, mut exit) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let [low, high] = [2 * axis, 2 * axis + 1].map(|row| f64::from(boxes[row][i]) - origin[axis]);
        if direction[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (low / direction[axis], high / direction[axis]);
        entry = entry.max(a.min(b));
        exit = exit.min(a.max(b));
    }
    entry <= exit
}

/// Distributions of photons that are difficult to search.
fn photons(table: &mut Table) {
    /// Position of the `i`th photon from random numbers.
    type Cloud = fn(&dyn Fn(u32) -> f32, u32) -> Vec3;
    let clouds: [(&str, Cloud); 6] = [
        ("in one point", |_, _| Vec3::new(0.3, -0.2, 0.1)),
        ("on a line", |draw, _| Vec3::new(draw(0), 0.5, 0.5)),
        ("on a plane far away", |draw, _| Vec3::new(1e6 + draw(0), 1e6, draw(1))),
        ("at all scales", |draw, i| {
            let scale = 10f32.powi(i as i32 % 13 - 6);
            scale * Vec3::new(draw(0), draw(1), draw(2))
        }),
        ("on a lattice, at equal distances", |_, i| {
            Vec3::new((i % 16) as f32, (i / 16 % 16) as f32, (i / 256) as f32)
        }),
        ("of size 1e-20", |draw, _| 1e-20 * Vec3::new(draw(0), draw(1), draw(2))),
    ];
    const COUNT: u32 = 3000;
    for (name, cloud) in clouds {
        let random = Random::new(7, 0);
        let position = |i: u32| cloud(&|k| random.single(4 * i + k), i);
        let Ok(mut memory) = Pages::new(Photons::footprint(COUNT as usize)) else { continue };
        let mut arena = Arena::over(&mut memory);
        let Ok(mut photons) = Photons::new(COUNT as usize, &mut arena) else { continue };
        for (i, photon) in photons.as_mut_slice().iter_mut().enumerate() {
            *photon = Photon::new(position(i as u32), Vec3::Z, Vec3::Z, Rgb::ONE);
        }
        let map = photons.build(COUNT as usize);
        let (mut wrong, mut searches) = (0, 0);
        for i in 0..96 {
            let centre = position(31 * i);
            let far = (position(31 * i + 1) - centre).length();
            for radius in [0.0, 0.1 * far, far, f32::INFINITY] {
                for level in [Level::BASELINE, Level::detect()] {
                    searches += 2;
                    wrong += u32::from(!finds_all(&map, level, centre, radius));
                    wrong += u32::from(!finds_nearest(&map, level, centre, radius));
                }
            }
        }
        table.exact(format!("photons {name}: searches find what brute force finds"), wrong, searches);
    }
}

fn finds_all(map: &PhotonMap, level: Level, centre: Vec3, radius: f32) -> bool {
    let mut found = vec![0; map.len()];
    let count = map.within(level, centre, radius, &mut found);
    brute::within(map, centre, radius).map(|(index, _)| index).eq(found.into_iter().take(count))
}

fn finds_nearest(map: &PhotonMap, level: Level, centre: Vec3, radius: f32) -> bool {
    const K: usize = 50;
    let Ok(mut memory) = Pages::new(Neighbours::footprint(K)) else { return false };
    let Ok(mut neighbours) = Neighbours::new(K, &mut Arena::over(&mut memory)) else { return false };
    map.nearest(level, centre, radius, &mut neighbours);
    let mut found: Vec<u32> = neighbours.iter().map(|(index, _)| index).collect();
    let mut all: Vec<(u32, f32)> = brute::within(map, centre, radius).collect();
    // Ties in distance go to the lower index.
    all.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let mut nearest: Vec<u32> = all.into_iter().take(K).map(|(index, _)| index).collect();
    found.sort_unstable();
    nearest.sort_unstable();
    found == nearest
}
