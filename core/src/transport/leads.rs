//! The search for images of lamps ([`super::images`]): where in the picture is a lamp seen in mirrors and through glass?
//!
//! From the corners of pixels all ways by which a camera ray is mirrored or refracted are followed. What the four corners of a
//! pixel say of a way is a beam, as wide as they are apart. Where a lamp may be in it, the pixel is cut into quarters, and again,
//! until corners see the lamp, or quarters are as small as they get: an image of a thousandth of a pixel costs as few
//! rays as a large one. A beam is only about straight, and what is overlooked stays with the paths.

use super::edges::CORNERS;
use super::estimator::Counters;
use super::images::{Image, Way, number};
use super::path::PathTracer;
use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::bvh::Coherence;
use crate::film::{TILE, Tile};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::emitted;
use crate::sampling::ONE_MINUS_EPSILON;
use crate::scene::SurfacePoint;
use glam::Vec3;

/// Most images that a tile may have. Further ones are left to the paths.
pub const MOST_IMAGES: usize = 1024;

/// Most ways that are followed from one point of the picture: those that paths take most often.
const MOST_WAYS: usize = 16;

/// Ways that paths take less often than this are left to them.
const LEAST_OFTEN: f32 = 1e-3;

/// A pixel that is full of an image which paths find as often as this is left to them.
const EASY: f32 = 0.5;

/// A pixel has so many parts for one way at most, and is cut so many times.
const MOST_PARTS: usize = 12;
const FINEST: u16 = 10;

/// Parts that fewer samples than this come to, by the way of their image, are not cut.
const RAREST: f32 = 1e-6;

/// A beam is looked at so far from its middle, in sides of its part: a half is all of it. At first, and where it has been cut so
/// often that it is as good as straight.
const WIDE: f32 = 1.0;
const NARROW: f32 = 0.7;
const STRAIGHT: u16 = 3;

/// What lies this much farther than where all corners of a beam end is hidden.
const BEHIND: f32 = 1.1;

/// Where paths take a way this often, parts are cut so many times though fewer than three corners know it. A beam of two is taken to be
/// as wide across as this many times along; one corner, at the outline of a ball, says nothing, and few parts of a tile are cut for it.
const OFTEN: f32 = 0.01;
const GUESSES: u16 = 2;
const GUESS: f32 = 2.0;
const MOST_GUESSES: u32 = 256;

/// Surfaces that a ray may start on at once.
const PASSED: u32 = 16;

/// Where a way leads to from a point of the picture: its last ray, and what that meets.
#[derive(Clone, Copy)]
struct Lead {
    way: Way,
    origin: Vec3,
    direction: Vec3,
    length: f32,
    /// Whether it meets a lamp.
    sees: bool,
    /// With what probability a path takes the way.
    probability: f32,
}

/// The ways from one point of the picture.
#[derive(Clone, Copy)]
struct Leads {
    all: [Option<Lead>; MOST_WAYS],
    count: usize,
}

impl Leads {
    const NONE: Leads = Leads { all: [None; MOST_WAYS], count: 0 };

    fn push(&mut self, lead: Lead) {
        if let Some(slot) = self.all.get_mut(self.count) {
            *slot = Some(lead);
            self.count += 1;
        }
    }

    fn iter(&self) -> impl Iterator<Item = &Lead> {
        self.all.iter().flatten()
    }

    fn by(&self, way: Way) -> Option<Lead> {
        self.iter().find(|lead| lead.way == way).copied()
    }
}

/// A ray on its way, before it is known what it meets.
#[derive(Clone, Copy)]
struct Start {
    ray: Ray,
    /// The triangle that it leaves.
    left: u32,
    way: Way,
    worth: Rgb,
    probability: f32,
}

impl Start {
    fn at_eye(ray: Ray) -> Self {
        Self { ray, left: MISS, way: Way::EYE, worth: Rgb::ONE, probability: 1.0 }
    }
}

/// What it met.
struct Met<'a> {
    start: Start,
    hit: Hit,
    point: Option<SurfacePoint<'a>>,
}

/// A part of a pixel, and where a way leads to from its corners.
#[derive(Clone, Copy)]
struct Part {
    column: u16,
    row: u16,
    corners: [Option<Lead>; 4],
}

/// All rays through a part by a way, from its corners: about affine in where they come from.
struct Beam {
    origin: [Vec3; 3],
    direction: [Vec3; 3],
    /// What is not affine: of origins, and of directions.
    bent: [f32; 2],
    /// From its middle, in sides of the part, so far it is looked at.
    reach: f32,
    /// Where all of its corners have ended.
    length: f32,
}

impl Beam {
    /// Of the corners that there are of a part that was cut `level` times: three at least, or two for a guess.
    fn of(corners: &[Option<Lead>; 4], level: u16, may_guess: bool) -> Option<Self> {
        let known = || corners.iter().flatten();
        if known().count() < if may_guess { 2 } else { 3 } {
            return None;
        }
        let parts = |of: &dyn Fn(&Lead) -> Vec3| -> ([Vec3; 3], f32) {
            let [a, b, c, d] = corners.each_ref().map(|corner| corner.as_ref().map(of));
            // A fourth one is where three say.
            let beside = |known: Option<Vec3>, [one, other, opposite]: [Option<Vec3>; 3]| {
                known.or_else(|| Some(one? + other? - opposite?))
            };
            let all = [(a, [b, c, d]), (b, [a, d, c]), (c, [a, d, b]), (d, [b, c, a])];
            if let [Some(a), Some(b), Some(c), Some(d)] = all.map(|(known, others)| beside(known, others)) {
                let middle = 0.25 * (a + b + c + d);
                let (across, down) = (0.5 * (b - a + d - c), 0.5 * (c - a + d - b));
                let bent = if known().count() < 4 {
                    across.length().max(down.length())
                } else {
                    (a - b - c + d).length()
                };
                return ([middle, across, down], bent);
            }
            let mut two = [a, b, c, d].into_iter().flatten();
            let [a, b] = [two.next().unwrap_or_default(), two.next().unwrap_or_default()];
            ([0.5 * (a + b), b - a, Vec3::ZERO], GUESS * a.distance(b))
        };
        let (origin, bent) = parts(&|lead| lead.origin);
        let (direction, turned) = parts(&|lead| lead.direction);
        let reach = if level < STRAIGHT { WIDE } else { NARROW };
        let length = known().map(|lead| lead.length).fold(0.0, f32::max);
        Some(Self { origin, direction, bent: [bent, turned], reach, length })
    }

    /// Whether it may come to a sphere.
    fn meets(&self, center: Vec3, radius: f32) -> bool {
        let [axis, ..] = self.direction;
        let to = center - self.origin[0];
        let t = (to.dot(axis) / axis.length_squared()).max(0.0);
        // From the centre to where rays are beside it: [middle, across, down].
        let mut aside = [0, 1, 2].map(|i| self.origin[i] + t * self.direction[i]);
        aside[0] -= center;
        let aside = aside.map(|x| x - axis * (x.dot(axis) / axis.length_squared()));
        // The least distance in the part, one coordinate after the other.
        let [middle, across, down] = aside;
        let best = |of: Vec3, rest: Vec3| {
            let x = -of.dot(rest) / of.length_squared();
            if x.is_finite() { x.clamp(-self.reach, self.reach) } else { 0.0 }
        };
        let (mut x, mut y) = (0.0, 0.0);
        for _ in 0..3 {
            x = best(across, middle + y * down);
            y = best(down, middle + x * across);
        }
        let least = (middle + x * across + y * down).length();
        let [bent, turned] = self.bent;
        let spread = self.direction[1].length() + self.direction[2].length();
        // What is no number is looked at.
        !(least > radius * (1.0 + spread) + bent + t * turned || t - radius > BEHIND * self.length)
    }
}

impl<'a, F: Features> PathTracer<'a, F> {
    /// Whether lamps may be seen in mirrors or through glass, and sharply.
    pub fn may_have_images(&self) -> bool {
        self.has_mirrors
            && !self.has_cutouts
            && self.scene.camera.lens_radius == 0.0
            && self.lights.have_emitters()
    }

    /// The images of lamps in tile `task`, into `out`; how many. The first [`MOST_IMAGES`] are kept.
    pub fn find_images(&self, task: usize, out: &mut [Image; MOST_IMAGES], counters: &mut Counters) -> usize {
        let tile = Tile::new(self.settings.width, self.settings.height, task);
        let [left, top] = tile.corner();
        let mut found = Found { out, count: 0, guesses: MOST_GUESSES };
        let (mut rays, mut hits) = ([Ray::segment(Vec3::ZERO, Vec3::Z, -1.0); CORNERS], [Hit::NONE; CORNERS]);
        let [mut above, mut below] = [[Leads::NONE; CORNERS]; 2];
        for y in 0..CORNERS as u32 {
            for (x, ray) in rays.iter_mut().enumerate() {
                *ray = self.raster_ray([(left + x as u32) as f32, (top + y) as f32]);
            }
            self.bvh.nearest_batch(self.level, &rays, Coherence::Coherent, &mut hits);
            counters.rays += CORNERS as u64;
            for (leads, (ray, hit)) in below.iter_mut().zip(rays.iter().zip(&hits)) {
                *leads = self.leads(*ray, *hit, counters);
            }
            for x in 0..TILE as usize {
                let corners = [&above[x], &above[x + 1], &below[x], &below[x + 1]];
                let [column, row] = [left + x as u32, (top + y).wrapping_sub(1)];
                let inside = column < self.settings.width && row < self.settings.height;
                if y > 0 && inside && corners.iter().any(|leads| leads.count > 0) {
                    self.look_into([column, row], corners, &mut found, counters);
                }
            }
            core::mem::swap(&mut above, &mut below);
        }
        found.count
    }

    /// What is seen of lamps from a point of the picture by a way: radiance, times what mirrors and glass leave of it.
    pub(super) fn seen_by(&self, way: Way, raster: [f32; 2], counters: &mut Counters) -> Rgb {
        self.walk(way, raster, counters).map_or(Rgb::ZERO, |met| met.start.worth * self.shine(&met))
    }

    /// From the eye through a point of the picture.
    pub(super) fn raster_ray(&self, [x, y]: [f32; 2]) -> Ray {
        self.scene.camera.ray(self.settings.width, self.settings.height, x, y, [0.0; 2])
    }

    /// The ways from what a camera ray has met.
    fn leads(&self, ray: Ray, hit: Hit, counters: &mut Counters) -> Leads {
        // Those that are still to be followed.
        let mut starts: [Option<Start>; 2 * MOST_WAYS] = [None; _];
        let mut leads = Leads::NONE;
        let mut met = self.pass(Start::at_eye(ray), hit, counters);
        while leads.count < MOST_WAYS {
            let branches = self.branches(&met);
            let often = branches.iter().filter(|start| start.is_some_and(|s| s.probability > LEAST_OFTEN));
            let free = starts.iter_mut().filter(|start| start.is_none());
            free.zip(often).for_each(|(free, start)| *free = *start);
            let share = |start: &Option<Start>| start.as_ref().map_or(0.0, |start| start.probability);
            let next = starts.iter_mut().max_by(|a, b| share(a).total_cmp(&share(b)));
            let Some(start) = next.and_then(Option::take) else { break };
            met = self.meet(start, counters);
            leads.push(self.lead_of(&met));
        }
        leads
    }

    /// What is met at the end of a way from a point of the picture.
    fn walk(&self, way: Way, raster: [f32; 2], counters: &mut Counters) -> Option<Met<'a>> {
        let mut met = self.meet(Start::at_eye(self.raster_ray(raster)), counters);
        for n in 0..way.surfaces() {
            let start = self.branches(&met)[usize::from(way.goes_through(n))]?;
            met = self.meet(start, counters);
        }
        Some(met)
    }

    fn lead_of(&self, met: &Met) -> Lead {
        let Start { ray, way, probability, .. } = met.start;
        let [origin, direction] = [ray.origin, ray.direction].map(Vec3::from);
        Lead { way, origin, direction, length: met.hit.t, sees: self.shine(met) != Rgb::ZERO, probability }
    }

    fn meet(&self, start: Start, counters: &mut Counters) -> Met<'a> {
        counters.rays += 1;
        self.pass(start, self.bvh.nearest(self.level, &start.ray), counters)
    }

    /// What a ray meets beyond what does not count, by the rule of paths: the surface that it leaves.
    fn pass(&self, start: Start, mut hit: Hit, counters: &mut Counters) -> Met<'a> {
        let (mut ray, mut left) = (start.ray, start.left);
        let mut point = SurfacePoint::at::<F>(self.scene, &ray, &hit);
        for _ in 0..PASSED {
            let Some(here) = &point else { break };
            if hit.triangle != left && !(start.way == Way::EYE && here.is_left_by(&ray)) {
                break;
            }
            left = hit.triangle;
            ray = here.spawn(ray.direction.into());
            hit = self.bvh.nearest(self.level, &ray);
            point = SurfacePoint::at::<F>(self.scene, &ray, &hit);
            counters.rays += 1;
        }
        Met { start, hit, point }
    }

    /// What the surface that was met emits towards the ray.
    fn shine(&self, met: &Met) -> Rgb {
        match &met.point {
            Some(point) if point.material.emits() => {
                emitted(self.scene, met.hit.triangle, point.uv, point.front)
            }
            _ => Rgb::ZERO,
        }
    }

    /// The ways on from what was met: mirrored and refracted.
    fn branches(&self, Met { start, hit, point }: &Met) -> [Option<Start>; 2] {
        let mut branches = [None; 2];
        let Some(point) = point.as_ref().filter(|point| point.material.surface.may_be_smooth()) else {
            return branches;
        };
        if start.way.surfaces() + 1 >= self.settings.max_depth {
            return branches;
        }
        let bsdf = Bsdf::at::<F>(self.scene, point.material, point.uv, point.front);
        let wo = point.frame.to_local(-Vec3::from(start.ray.direction));
        // The first and the last of the lobes.
        for u in [0.0, ONE_MINUS_EPSILON] {
            let sample = bsdf.sample::<F>(wo, [0.5, 0.5, u]).filter(|sample| sample.delta);
            let Some(BsdfSample { direction, weight, pdf, transmitted, .. }) = sample else { continue };
            let next = point.frame.to_world(direction);
            let way = start.way.on(transmitted);
            if point.sides_agree(direction, next) && way != Way::LOST {
                let (worth, probability) = (start.worth * weight * pdf, start.probability * pdf);
                let (ray, left) = (point.spawn(next), hit.triangle);
                branches[usize::from(transmitted)] = Some(Start { ray, left, way, worth, probability });
            }
        }
        branches
    }

    /// The images in a pixel, by the leads of its corners.
    fn look_into(&self, pixel: [u32; 2], corners: [&Leads; 4], found: &mut Found, counters: &mut Counters) {
        for (i, leads) in corners.iter().enumerate() {
            for lead in leads.iter() {
                // Each way once.
                if corners.iter().take(i).all(|leads| leads.by(lead.way).is_none()) {
                    let corners = corners.map(|leads| leads.by(lead.way));
                    self.look_for((pixel, lead.way), corners, found, counters);
                }
            }
        }
    }

    /// The images in a pixel by one way.
    fn look_for(
        &self,
        (pixel, way): ([u32; 2], Way),
        corners: [Option<Lead>; 4],
        found: &mut Found,
        counters: &mut Counters,
    ) {
        let whole = Part { column: 0, row: 0, corners };
        if sees_all(&corners) {
            if corners.iter().flatten().any(|lead| lead.probability < EASY) {
                found.push(pixel, way, &whole, 0);
            }
            return;
        }
        if !self.may_see(&corners, 0, &mut found.guesses) {
            return;
        }
        let before = found.count;
        // Parts that are full of the image are done; others are cut.
        let (mut parts, mut count, mut level) = ([None; MOST_PARTS], 1, 0);
        parts[0] = Some(whole);
        let often = corners.iter().flatten().map(|lead| lead.probability).fold(0.0, f32::max);
        while count > 0 && level < FINEST && often > RAREST * (1_u32 << (2 * level)) as f32 {
            let mut next = [None; 4 * MOST_PARTS];
            let mut kept = 0;
            for part in parts.iter().flatten() {
                for quarter in self.quarters((pixel, way), part, level, counters) {
                    if self.may_see(&quarter.corners, level + 1, &mut found.guesses) {
                        next[kept] = Some(quarter);
                        kept += 1;
                    }
                }
            }
            if kept + found.count - before > MOST_PARTS {
                break;
            }
            level += 1;
            (parts, count) = ([None; MOST_PARTS], 0);
            for part in next.iter().flatten() {
                if sees_all(&part.corners) {
                    found.push(pixel, way, part, level);
                } else if let Some(slot) = parts.get_mut(count) {
                    *slot = Some(*part);
                    count += 1;
                }
            }
        }
        parts.iter().flatten().for_each(|part| found.push(pixel, way, part, level));
    }

    /// Whether a lamp may be seen through a part, which was cut `level` times.
    fn may_see(&self, corners: &[Option<Lead>; 4], level: u16, guesses: &mut u32) -> bool {
        if corners.iter().flatten().any(|lead| lead.sees) {
            return true;
        }
        // What paths take so seldom is not worth a guess.
        let is_often = corners.iter().flatten().any(|lead| lead.probability >= OFTEN);
        let may_guess = is_often && level < GUESSES;
        let Some(beam) = Beam::of(corners, level, may_guess) else {
            let is_guess = may_guess && *guesses > 0 && corners.iter().flatten().count() == 1;
            *guesses -= u32::from(is_guess);
            return is_guess;
        };
        let middle = [beam.origin[0], beam.direction[0]];
        self.lights.may_be_met(middle, |center, radius| beam.meets(center, radius))
    }

    /// The quarters of a part.
    fn quarters(
        &self,
        (pixel, way): ([u32; 2], Way),
        part: &Part,
        level: u16,
        counters: &mut Counters,
    ) -> [Part; 4] {
        let side = (1_u32 << level) as f32;
        let mut at = |dx: f32, dy: f32| {
            let [x, y] = [(f32::from(part.column) + dx) / side, (f32::from(part.row) + dy) / side];
            let met = self.walk(way, [pixel[0] as f32 + x, pixel[1] as f32 + y], counters);
            met.map(|met| self.lead_of(&met))
        };
        let [a, b, c, d] = part.corners;
        let [top, left, middle, right, bottom] =
            [at(0.5, 0.0), at(0.0, 0.5), at(0.5, 0.5), at(1.0, 0.5), at(0.5, 1.0)];
        let corners = [
            [a, top, left, middle],
            [top, b, middle, right],
            [left, middle, c, bottom],
            [middle, right, bottom, d],
        ];
        let mut i = 0;
        corners.map(|corners| {
            let (column, row) = (2 * part.column + (i & 1), 2 * part.row + (i >> 1));
            i += 1;
            Part { column, row, corners }
        })
    }
}

/// Whether all corners of a part meet a lamp.
fn sees_all(corners: &[Option<Lead>; 4]) -> bool {
    corners.iter().all(|lead| lead.is_some_and(|lead| lead.sees))
}

/// The images that were found in a tile.
struct Found<'o> {
    out: &'o mut [Image; MOST_IMAGES],
    count: usize,
    /// Parts that may still be cut though one corner alone knows the way.
    guesses: u32,
}

impl Found<'_> {
    fn push(&mut self, [x, y]: [u32; 2], way: Way, part: &Part, level: u16) {
        if let Some(slot) = self.out.get_mut(self.count) {
            let pixel = number([x % TILE, y % TILE]);
            *slot = Image { way, column: part.column, row: part.row, level, pixel };
            self.count += 1;
        }
    }
}
