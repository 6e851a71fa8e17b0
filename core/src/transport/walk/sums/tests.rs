//! The running sums against all densities written down: random paths over all kinds of lights, rough
//! vertices and casters, mirrors and refraction.

use super::*;
use crate::sampling::Random;
use std::vec;
use std::vec::Vec;

mod recursive;

/// A light of a random path.
#[derive(Clone, Copy, PartialEq)]
enum Light {
    Area,
    Environment,
    Point,
    Directional,
}

/// A vertex of a random path with the densities of both walks, per solid angle.
#[derive(Clone, Copy, Default)]
struct Vertex {
    is_delta: bool,
    /// Neither delta nor a caster.
    is_rough: bool,
    /// η, if paths are merged here.
    eta_vcm: f64,
    /// Cosines to the vertex before, as the light walk sees it, and to that behind.
    cos: [f64; 2],
    /// Density of the light walk on to the vertex behind, and of the camera walk on to the vertex before.
    pdf: [f64; 2],
    /// Index behind over that before.
    eta: f64,
}

/// A path of `vertices` between its light and its lens.
struct Path {
    light: Light,
    /// x₁ … x_{k-1}.
    vertices: Vec<Vertex>,
    /// Squared length of the segment before each vertex, and of the one to the lens.
    squared: Vec<f64>,
    /// dω/dA of the chain of delta vertices from each vertex.
    jacobian: Vec<f64>,
    cos_at_light: f64,
    choice: f64,
    place: f64,
    direction: f64,
    pdf_light: f64,
    pixel: f64,
}

/// Mistakes that shipped renderers have made.
#[derive(Clone, Copy, PartialEq)]
enum Mistake {
    None,
    /// The camera's `rest` starts at one.
    CameraStart,
    /// The number of light paths is missing at the camera.
    NoCount,
    /// Light samples and light paths choose lights by different distributions, and one side takes the wrong
    /// one.
    LightChoice,
    /// The light sample's density of hitting the light has a roulette that the walk has not.
    Roulette,
    /// Delta lobes keep cosines alone, not the squared index of refraction.
    Etendue,
}

fn random_path(random: &Random, counter: &mut u32) -> Path {
    let mut next = || {
        *counter += 1;
        f64::from(random.single(*counter))
    };
    let mut within = |low: f64, high: f64| low + (high - low) * next();
    let lights = [Light::Area, Light::Environment, Light::Point, Light::Directional];
    let light = lights[within(0.0, 4.0) as usize];
    let count = 1 + within(0.0, 6.0) as usize;
    let vertices: Vec<Vertex> = (0..count)
        .map(|_| {
            let kind = within(0.0, 1.0);
            let eta = if kind < 0.15 { within(0.6, 1.7) } else { 1.0 };
            let is_delta = kind < 0.3;
            let spread = if kind > 0.8 { 30.0 } else { 1.0 };
            let cos = [within(0.05, 1.0), within(0.05, 1.0)];
            let pdf = [spread * within(0.05, 1.0), spread * within(0.05, 1.0)];
            let is_rough = !is_delta && within(0.0, 1.0) < 0.6;
            // Some rough surfaces hold no photons.
            let eta_vcm = if within(0.0, 1.0) < 0.8 { within(0.01, 10.0) } else { 0.0 };
            Vertex { is_delta, is_rough, eta_vcm, cos, pdf, eta }
        })
        .collect();
    Path {
        light,
        squared: (0..=count).map(|_| within(0.05, 4.0)).collect(),
        jacobian: (0..=count).map(|_| within(0.05, 20.0)).collect(),
        vertices,
        cos_at_light: within(0.05, 1.0),
        choice: within(0.05, 1.0),
        place: within(0.5, 50.0),
        direction: within(0.1, 3.0),
        pdf_light: within(0.1, 30.0),
        pixel: within(1.0, 1e5),
    }
}

impl Path {
    fn can_be_hit(&self) -> bool {
        matches!(self.light, Light::Area | Light::Environment)
    }

    /// Density of emission per étendue, or per area across the beam.
    fn emission(&self) -> f64 {
        self.choice
            * match self.light {
                Light::Area => self.place * self.direction / self.cos_at_light,
                Light::Environment => self.place * self.direction,
                Light::Directional => self.place,
                Light::Point => self.direction / self.squared[0],
            }
    }

    /// True if light that comes to vertex `i` may be merged there.
    fn arrival(&self, i: usize) -> Option<Arrival> {
        let of = |i: usize| {
            Arrival::of(
                !self.vertices[i - 2].is_rough,
                self.squared[i - 1] as f32,
                self.vertices[i - 1].eta_vcm as f32,
            )
        };
        if i > 1 { of(i) } else { None }
    }

    /// True if it is merged there, in a path of this length.
    fn is_caustic(&self, i: usize) -> bool {
        let segments = (self.vertices.len() + 1 - i) as u32;
        self.arrival(i).is_some_and(|arrival| arrival.is_merged(segments))
    }

    /// The vertex that the path is merged at: the first rough one from the camera, if light comes so to it.
    fn merged(&self) -> Option<usize> {
        let first = (1..=self.vertices.len()).rev().find(|&i| self.vertices[i - 1].is_rough)?;
        (self.is_caustic(first) && self.vertices[first - 1].eta_vcm > 0.0).then_some(first)
    }

    /// Counts times densities of all techniques, as products over the vertices that are not delta; that of
    /// the merge comes last.
    fn brute(&self, counts: [f64; 3], merges: bool) -> Vec<f64> {
        let [light_paths, connections, light_samples] = counts;
        let k = self.vertices.len() + 1;
        let is_delta = |i: usize| i > 0 && i < k && self.vertices[i - 1].is_delta;
        let solid: Vec<usize> = (0..=k).filter(|&i| !is_delta(i)).collect();
        // Densities per area of the step over each pair of neighbours among them, by both walks.
        let steps: Vec<[f64; 2]> = solid
            .windows(2)
            .map(|pair| {
                let (a, b) = (pair[0], pair[1]);
                let forward = if a == 0 {
                    self.choice
                        * match self.light {
                            Light::Area | Light::Environment => self.place * self.direction,
                            Light::Directional => self.place,
                            Light::Point => self.direction,
                        }
                } else {
                    self.vertices[a - 1].pdf[0]
                };
                let back = if b == k { self.pixel } else { self.vertices[b - 1].pdf[1] };
                let is_far = matches!(self.light, Light::Environment | Light::Directional);
                let cos_a = match a {
                    0 if self.light == Light::Area => self.cos_at_light,
                    0 => 1.0,
                    _ => self.vertices[a - 1].cos[1],
                };
                let cos_b = if b == k { 1.0 } else { self.vertices[b - 1].cos[0] };
                if b == a + 1 {
                    let squared = self.squared[a];
                    return match a == 0 && is_far {
                        true => [forward * cos_b, back],
                        false => [forward * cos_b / squared, back * cos_a / squared],
                    };
                }
                let squeeze: f64 = (a + 1..b).map(|i| self.vertices[i - 1].eta.powi(2)).product();
                let jacobian = self.jacobian[a];
                [forward * jacobian, back * cos_a * jacobian / (cos_b * squeeze)]
            })
            .collect();
        let last = solid.len() - 1;
        let by_light = |i: usize| steps[..i].iter().map(|step| step[0]).product::<f64>();
        let by_camera = |i: usize| steps[i..].iter().map(|step| step[1]).product::<f64>();
        let mut all = vec![if self.can_be_hit() { by_camera(0) } else { 0.0 }];
        for i in 0..last {
            let is_next = solid[i] + 1 == solid[i + 1];
            all.push(match i {
                _ if !is_next => 0.0,
                0 if last == 1 => 0.0,
                0 => {
                    let per_area = match self.light {
                        Light::Area => self.cos_at_light / self.squared[0],
                        _ => 1.0,
                    };
                    light_samples * self.pdf_light * per_area * by_camera(1)
                }
                _ if i + 1 == last => light_paths * by_light(i),
                _ => connections * by_light(i) * by_camera(i + 1),
            });
        }
        let merge = self.merged().filter(|_| merges).map_or(0.0, |vertex| {
            let at = solid.iter().position(|&i| i == vertex).unwrap();
            self.vertices[vertex - 1].eta_vcm * by_light(at) * by_camera(at)
        });
        let sum: f64 = all.iter().sum::<f64>() + merge;
        // Weights by the connected segment: 0 is the hit, s the segment after x_{s-1}.
        let mut weights = vec![0.0; k + 1];
        weights[0] = all[0] / sum;
        for (i, density) in all[1..].iter().enumerate() {
            weights[1 + solid[i]] += density / sum;
        }
        weights.push(merge / sum);
        weights
    }
}

/// The largest difference of weights, and of their sum to one, over random paths.
fn worst(mistake: Mistake) -> [f32; 2] {
    let (random, mut counter) = (Random::new(3, 5), 0);
    let mut worst = [0.0f32; 2];
    for i in 0..20_000 {
        let path = random_path(&random, &mut counter);
        let counts = [[0.25, 1.0, 1.0], [1.0, 0.37, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [4.0, 2.0, 3.0]];
        let [light_paths, connections, light_samples] = counts[i % 5];
        let merges = i / 5 % 2 == 0;
        let all = path.brute(counts[i % 5], merges);
        if all.iter().any(|weight| !weight.is_finite()) {
            // No technique can make the path.
            continue;
        }
        let counts = Counts {
            light_paths: light_paths as f32,
            connections: connections as f32,
            light_samples: light_samples as f32,
        };
        let weights = path.recursive(&counts, merges, mistake);
        for (weight, expected) in weights.iter().zip(&all) {
            worst[0] = worst[0].max((weight - *expected as f32).abs());
        }
        worst[1] = worst[1].max((weights.iter().sum::<f32>() - 1.0).abs());
    }
    worst
}

#[test]
fn weights_are_those_of_all_densities_and_add_up_to_one() {
    let [difference, sum] = worst(Mistake::None);
    assert!(difference < 2e-5 && sum < 2e-5, "{difference} {sum}");
}

#[test]
fn mistakes_of_shipped_renderers_are_noticed() {
    for mistake in [Mistake::CameraStart, Mistake::NoCount, Mistake::LightChoice, Mistake::Roulette] {
        let [difference, sum] = worst(mistake);
        assert!(difference > 1e-2 && sum > 1e-2, "{difference} {sum}");
    }
    // Both walks make the same error the other way round: noise, not bias.
    let [difference, sum] = worst(Mistake::Etendue);
    assert!(difference > 1e-2 && sum < 2e-5, "{difference} {sum}");
}
