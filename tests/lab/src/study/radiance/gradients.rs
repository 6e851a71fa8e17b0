//! Errors of the derivatives of coefficients in rooms with exact coefficients: by borders, and without
//! occlusion as in Křivánek et al. (2005).

use super::polygons::add_coefficients;
use super::{Row, hemisphere};
use core::array::from_fn;
use glam::{DVec2, DVec3, Vec2, Vec3};
use halflight::pages::Pages;
use halflight_core::Level;
use halflight_core::cache::radiance::derivatives::{Gradients, border_flux, displaced, unoccluded};
use halflight_core::cache::radiance::lobes::LobeTable;
use halflight_core::cache::radiance::zernike::{COUNT_MAX, count};
use halflight_core::cache::radiance::{Basis, StrataTables};
use halflight_core::memory::{Arena, OutOfMemory};
use halflight_core::sampling::warp::cosine_hemisphere;
use halflight_test_support::polygon::behind;
use halflight_test_support::{CeilingPatch, FloatingSquare, GatherRays, Random, Room};
use serde_json::{Value, json};

/// Four walls and a black square.
const OCCLUDED: Room = Room {
    walls: [1.0, 0.2, 0.5, 0.8, 0.3],
    patch: None,
    square: Some(FloatingSquare { centre: DVec3::new(0.45, 0.5, 0.3), side: 0.4 }),
    is_sky: false,
};

/// Bright square of the ceiling of a dark room.
const LAMP: Room = Room {
    walls: [0.1; 5],
    patch: Some(CeilingPatch { corner: DVec2::new(0.6, 0.55), side: 0.2, radiance: 10.0 }),
    square: None,
    is_sky: false,
};

/// Rooms of the study by name.
const ROOMS: [(&str, Room); 5] = [
    ("uniform sky, black square", Room { walls: [1.0; 5], is_sky: true, ..OCCLUDED }),
    ("four walls, black square", OCCLUDED),
    ("lamp behind black square", Room { square: OCCLUDED.square, ..LAMP }),
    ("four walls", Room { square: None, ..OCCLUDED }),
    ("lamp", LAMP),
];

/// Exact coefficients at a point of the floor.
fn coefficients(room: &Room, at: DVec2) -> [f64; COUNT_MAX] {
    let square = room.occluder(at);
    let mut sum = [0.0; COUNT_MAX];
    for (polygon, radiance) in room.polygons(at) {
        add_coefficients(&polygon, radiance, &mut sum);
        if let Some(square) = &square {
            add_coefficients(&behind(square, &polygon), -radiance, &mut sum);
        }
    }
    sum
}

/// Exact derivatives of the coefficients by central differences over `h`: x, y, xx, xy, yy.
fn derivatives(room: &Room, from: DVec2, h: f64) -> [[f64; 5]; COUNT_MAX] {
    let at = |i: i32, j: i32| coefficients(room, from + h * DVec2::new(f64::from(i), f64::from(j)));
    let [here, east, west, north, south] = [at(0, 0), at(1, 0), at(-1, 0), at(0, 1), at(0, -1)];
    let corners = [at(1, 1), at(1, -1), at(-1, 1), at(-1, -1)];
    from_fn(|k| {
        [
            (east[k] - west[k]) / (2.0 * h),
            (north[k] - south[k]) / (2.0 * h),
            (east[k] - 2.0 * here[k] + west[k]) / (h * h),
            (corners[0][k] - corners[1][k] - corners[2][k] + corners[3][k]) / (4.0 * h * h),
            (north[k] - 2.0 * here[k] + south[k]) / (h * h),
        ]
    })
}

/// Errors of derivatives in a room, as root mean squares over receivers relative to that of the truth.
#[derive(Debug)]
pub(super) struct GradientError {
    room: &'static str,
    /// True if a surface in the air hides others.
    is_occluded: bool,
    /// Strata along a side.
    strata: usize,
    /// Gradients of the coefficients of degrees 0, 2, 4 and 6 by borders.
    gradient: [f64; 4],
    /// Hessians of these coefficients by borders.
    hessian: [f64; 4],
    /// Gradient of the radiance that leaves metal of alpha 0.3: by borders, by derivatives of basis and solid
    /// angle, and by finite displacement.
    leaving: [f64; 3],
}

impl Row for GradientError {
    fn head() -> String {
        "errors of derivatives, relative to their size; reflected: gradient of the light from metal of alpha 0.3\n\
         \x20                               gradient of degree      Hessian of degree       reflected\n\
         room                    strata       0     2     4     6     0     2     4     6 borders  paper shifted"
            .into()
    }

    fn line(&self) -> String {
        let degrees = |errors: [f64; 4]| errors.map(|error| format!("{error:>6.3}")).concat();
        let [borders, analytic, displaced] = self.leaving;
        format!(
            "{:<27} {:>3} {}{} {:>7.3} {:>6.3} {:>7.3}",
            self.room,
            self.strata,
            degrees(self.gradient),
            degrees(self.hessian),
            borders,
            analytic,
            displaced,
        )
    }

    fn object(&self) -> Value {
        let [borders, analytic, displaced] = self.leaving;
        json!({
            "room": self.room,
            "occluded": self.is_occluded,
            "strata": self.strata,
            "gradient": self.gradient,
            "hessian": self.hessian,
            "reflected": { "borders": borders, "analytic": analytic, "displaced": displaced },
        })
    }
}

/// Receivers on the floor.
const RECEIVERS: usize = 24;
/// Degree of the representation.
const DEGREE: usize = 6;
/// Step of the finite displacement and of differences, in sides of the room.
const STEP: f32 = 1e-3;

/// Sum of squared errors, and of squares of the truth.
#[derive(Clone, Copy, Default)]
struct Squares([f64; 2]);

impl Squares {
    fn add(&mut self, found: f64, truth: f64, weight: f64) {
        self.0[0] += weight * (found - truth) * (found - truth);
        self.0[1] += weight * truth * truth;
    }

    fn relative(self) -> f64 {
        (self.0[0] / self.0[1]).sqrt()
    }
}

/// Lobes of metal of alpha 0.3 for viewers at 20° and 50°, all around.
fn lobes(table: &LobeTable) -> Vec<[f32; COUNT_MAX]> {
    let viewers = [20.0f32, 50.0].into_iter().flat_map(|angle| (0..8).map(move |turn| (angle, turn)));
    let lobe = |(angle, turn): (f32, u16)| {
        let towards = Vec2::from_angle(f32::from(turn) * core::f32::consts::FRAC_PI_4);
        let weights = table.lobe(angle.to_radians().cos(), 0.3)?.turned(towards).of(1.0);
        weights.first_chunk().copied()
    };
    viewers.filter_map(lobe).collect()
}

/// Errors in every room with each number of strata along a side.
pub(super) fn measure(strata: &[usize], each: &mut dyn FnMut(&GradientError)) -> Result<(), OutOfMemory> {
    for room in &ROOMS {
        for &strata in strata {
            each(&errors(room, strata)?);
        }
    }
    Ok(())
}

/// Errors in one room with `strata` strata along a side.
fn errors((name, room): &(&'static str, Room), strata: usize) -> Result<GradientError, OutOfMemory> {
    let mut memory = Pages::new(StrataTables::footprint(strata, DEGREE))?;
    let tables = StrataTables::build(strata, DEGREE, &mut Arena::over(&mut memory))?;
    let mut memory = Pages::new(LobeTable::footprint(Basis::Zernike))?;
    let lobes = lobes(&LobeTable::build(Basis::Zernike, &mut Arena::over(&mut memory))?);
    let mut random = Random(17);
    let (mut gradient, mut hessian, mut leaving) = <([Squares; 4], [Squares; 4], [Squares; 3])>::default();
    for _ in 0..RECEIVERS {
        let from = DVec2::new(0.1 + 0.8 * random.unit(), 0.1 + 0.8 * random.unit());
        let truth = derivatives(room, from, STEP.into());
        let hit = |w: Vec3| room.hit(from, w.as_dvec3());
        let rays = GatherRays::new(strata, cosine_hemisphere, || random.unit(), hit);
        let Some(hemisphere) = hemisphere(&rays) else { continue };
        let Some(flux) = border_flux(Level::detect(), &tables, &hemisphere) else { continue };
        for (group, degree) in [0, 2, 4, 6].into_iter().enumerate() {
            for (k, truth) in truth.iter().enumerate().take(count(degree)).skip(count(degree) - degree - 1) {
                let ([x, y], found) = (flux.gradients[0][k], flux.hessians[k]);
                gradient[group].add(f64::from(x), truth[0], 1.0);
                gradient[group].add(f64::from(y), truth[1], 1.0);
                for (found, truth, weight) in
                    [(found.xx, truth[2], 1.0), (found.xy, truth[3], 2.0), (found.yy, truth[4], 1.0)]
                {
                    hessian[group].add(f64::from(found), truth, weight);
                }
            }
        }
        let rivals =
            [Some(flux.gradients), unoccluded(&tables, &hemisphere), displaced(&tables, &hemisphere, STEP)];
        for lobe in &lobes {
            for axis in 0..2 {
                let functions = lobe.iter().zip(&truth).take(count(DEGREE));
                let truth: f64 = functions.map(|(&c, truth)| f64::from(c) * truth[axis]).sum();
                for (leaving, gradients) in leaving.iter_mut().zip(&rivals) {
                    let Some(gradients) = gradients else { continue };
                    leaving.add(along(lobe, gradients, axis), truth, 1.0);
                }
            }
        }
    }
    Ok(GradientError {
        room: name,
        is_occluded: room.square.is_some(),
        strata,
        gradient: gradient.map(Squares::relative),
        hessian: hessian.map(Squares::relative),
        leaving: leaving.map(Squares::relative),
    })
}

/// Σ c ∂λ/∂axis.
fn along(lobe: &[f32; COUNT_MAX], gradients: &Gradients, axis: usize) -> f64 {
    lobe.iter().zip(&gradients[0]).map(|(&c, gradient)| f64::from(c * gradient[axis])).sum()
}

#[cfg(test)]
mod exact_edges;

#[cfg(test)]
mod tests {
    use super::*;

    /// Borders see occlusion; derivatives of basis and solid angle, and finite displacement, do not.
    #[test]
    fn borders_see_occluders_that_the_gradients_of_the_paper_miss() {
        for room in &ROOMS {
            let found = errors(room, 32).unwrap();
            let [flux, analytic, displaced] = found.leaving;
            assert!((analytic - displaced).abs() < 0.01, "{found:?}");
            match room.0 {
                "four walls, black square" => {
                    assert!(found.gradient[..2].iter().all(|error| *error <= 0.09), "{found:?}");
                    assert!(flux <= 0.09 && analytic >= 0.45, "{found:?}");
                }
                "uniform sky, black square" => assert!(flux < 0.08 && analytic > 0.99, "{found:?}"),
                _ if room.1.square.is_none() => assert!(flux < 0.2 && analytic < 0.2, "{found:?}"),
                _ => {}
            }
        }
    }

    #[test]
    fn errors_fall_with_the_strata() {
        for room in [&ROOMS[0], &ROOMS[3]] {
            let [coarse, fine] = [16, 64].map(|n| errors(room, n).unwrap());
            for (coarse, fine) in coarse.gradient.iter().zip(fine.gradient) {
                assert!(fine < 0.5 * coarse, "{}: {coarse} {fine}", room.0);
            }
            for (coarse, fine) in coarse.hessian.iter().zip(fine.hessian) {
                assert!(fine < 0.5 * coarse, "{}: {coarse} {fine}", room.0);
            }
        }
    }
}
