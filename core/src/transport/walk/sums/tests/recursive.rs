//! Weights of all techniques by running sums, as both walks carry them.

use super::{Mistake, Path};
use crate::transport::walk::sums::*;
use std::vec;
use std::vec::Vec;

/// Sums of a camera path.
struct CameraSums {
    /// On arrival at each vertex.
    arrived: Vec<Sums>,
    /// After the last scattering, at the light.
    at_light: Sums,
    /// η at each vertex that the path may be merged at.
    merge: Vec<f32>,
    /// True if a rough vertex lies between the camera and each vertex.
    has_rough: Vec<bool>,
}

impl Path {
    /// The count of merges at vertex `i`.
    fn count(&self, i: usize, merges: bool) -> f32 {
        if merges { self.vertices[i - 1].eta_vcm as f32 } else { 0.0 }
    }

    /// The sums after a delta vertex with cosines `cos` to both sides.
    fn scatter_delta(sums: Sums, cos: [f64; 2], eta: f64, mistake: Mistake) -> Sums {
        match mistake {
            Mistake::Etendue => sums.scatter_delta(cos[1] as f32, 1.0),
            _ => sums.scatter_delta(cos[0] as f32, eta as f32),
        }
    }

    /// The sums of the light path on arrival at each vertex.
    fn light_sums(&self, counts: &Counts, merges: bool, mistake: Mistake) -> Vec<Sums> {
        let k = self.vertices.len() + 1;
        let f = |x: f64| x as f32;
        let mut light = vec![Sums::default(); k + 1];
        let mut sums = Sums::default();
        let choice = if mistake == Mistake::LightChoice { self.choice } else { 1.0 };
        for (i, arrived) in light.iter_mut().enumerate().take(k).skip(1) {
            let vertex = &self.vertices[i - 1];
            sums = match i {
                1 => {
                    let pdf_light = f(self.pdf_light * choice);
                    let can_be_hit = self.can_be_hit();
                    let first =
                        Sums::at_light(counts, pdf_light, f(self.emission()), f(vertex.cos[0]), can_be_hit);
                    Sums { last: if vertex.is_delta { 0.0 } else { first.last }, ..first }
                }
                _ => sums.arrive(f(self.squared[i - 1]), f(vertex.cos[0]), vertex.is_delta),
            };
            let has_merges = merges && self.arrival(i).is_some();
            let eta_vcm = vertex.is_rough.then(|| self.count(i, has_merges));
            *arrived = Sums { pending_merge: eta_vcm.unwrap_or(sums.pending_merge), ..sums };
            sums = match vertex.is_delta {
                true => Self::scatter_delta(sums, vertex.cos, vertex.eta, mistake),
                false => sums.scatter(counts, f(vertex.pdf[0]), f(vertex.pdf[1]), f(vertex.cos[1]), eta_vcm),
            };
        }
        light
    }

    /// The sums of the camera path.
    fn camera_sums(&self, counts: &Counts, merges: bool, mistake: Mistake) -> CameraSums {
        let k = self.vertices.len() + 1;
        let f = |x: f64| x as f32;
        let mut arrived = vec![Sums::default(); k + 1];
        let paths = if mistake == Mistake::NoCount { 1.0 } else { counts.light_paths };
        let mut sums = Sums::at_camera(&Counts { light_paths: paths, ..*counts }, f(self.pixel));
        if mistake == Mistake::CameraStart {
            sums.rest = 1.0;
        }
        let (mut merge, mut has_rough) = (vec![0.0; k + 1], vec![false; k + 1]);
        for i in (1..k).rev() {
            let vertex = &self.vertices[i - 1];
            sums = sums.arrive(f(self.squared[i]), f(vertex.cos[1]), vertex.is_delta);
            if i + 1 < k && self.is_caustic(i + 1) {
                sums = sums.with_merge();
            }
            arrived[i] = sums;
            has_rough[i - 1] = has_rough[i] || vertex.is_rough;
            merge[i] = if vertex.is_rough && !has_rough[i] { self.count(i, merges) } else { 0.0 };
            let here = vertex.is_rough.then_some(merge[i]);
            sums = match vertex.is_delta {
                true => {
                    let cos = [vertex.cos[1], vertex.cos[0]];
                    Self::scatter_delta(sums, cos, 1.0 / vertex.eta, mistake)
                }
                false => sums.scatter(counts, f(vertex.pdf[1]), f(vertex.pdf[0]), f(vertex.cos[0]), here),
            };
        }
        CameraSums { arrived, at_light: sums, merge, has_rough }
    }

    /// The weights by running sums, in the same order.
    pub(super) fn recursive(&self, counts: &Counts, merges: bool, mistake: Mistake) -> Vec<f32> {
        let k = self.vertices.len() + 1;
        let f = |x: f64| x as f32;
        let at = |i: usize| &self.vertices[i - 1];
        let light = self.light_sums(counts, merges, mistake);
        let CameraSums { arrived: camera, at_light: sums, merge, has_rough } =
            self.camera_sums(counts, merges, mistake);
        let mut weights = vec![0.0; k + 1];
        let first = at(1);
        let (pdf_light, emission) = (f(self.pdf_light), f(self.emission()));
        if self.can_be_hit() {
            let pdf = (!first.is_delta).then_some(f(first.pdf[1]));
            weights[0] = weight_of_hit(counts, &sums, pdf, pdf_light, emission);
        }
        if !first.is_delta {
            let roulette = if mistake == Mistake::Roulette { 0.5 } else { 1.0 };
            let pdf = if self.can_be_hit() { roulette * f(first.pdf[1]) } else { 0.0 };
            let geometry = (f(first.cos[0]), roulette * f(first.pdf[0]));
            weights[1] = weight_of_light_sample(counts, &camera[1], (pdf, pdf_light), emission, geometry);
        }
        for i in 1..k - 1 {
            let (y, z) = (at(i), at(i + 1));
            if y.is_delta || z.is_delta {
                continue;
            }
            let end = |sums: Sums, pdf: f64, reverse: f64, cos: f64, merge: f32| End {
                sums,
                pdf: f(pdf),
                reverse: f(reverse),
                cos: f(cos),
                merge,
            };
            let at_camera = if self.is_caustic(i + 1) { merge[i + 1] } else { 0.0 };
            let at_light = match has_rough[i] {
                true => 0.0,
                false => light[i].pending_merge * if y.is_rough { 1.0 } else { f(y.pdf[1]) },
            };
            let y = end(light[i], y.pdf[0], y.pdf[1], y.cos[1], at_light);
            let z = end(camera[i + 1], z.pdf[1], z.pdf[0], z.cos[0], at_camera);
            weights[i + 1] = weight_of_connection(counts, &z, &y, f(self.squared[i]));
        }
        let last = at(k - 1);
        if !last.is_delta {
            let pdf_area = f(self.pixel * last.cos[1] / self.squared[k - 1]);
            let merge = match last.is_rough {
                true if self.is_caustic(k - 1) => light[k - 1].pending_merge,
                true => 0.0,
                false => light[k - 1].pending_merge * f(last.pdf[1]),
            };
            weights[k] = weight_of_splat(counts, &light[k - 1], pdf_area, f(last.pdf[1]), merge);
        }
        let merged = (1..k).find(|&i| merge[i] > 0.0 && self.is_caustic(i));
        weights.push(merged.map_or(0.0, |i| {
            let (camera, light) = ((&camera[i], f(at(i).pdf[0])), (&light[i], f(at(i).pdf[1])));
            weight_of_merge(merge[i], camera, light)
        }));
        weights
    }
}
