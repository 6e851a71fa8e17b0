//! Where a scene is fine: the part whose precision counts. The core computes in f32, whose numbers are densest at the origin.
//! As a rule the origin is the centre of the bounding box; where few large triangles, a ground or a sun, reach very much
//! further than all that is small, it is the centre of the latter, and large triangles are cut ([`super::split`]).

use super::geometry::{Placed, bounds};
use super::transform::SceneTransform;
use glam::DVec3;

/// A bounding box that is longer than this many times what is small: f32 would round the latter to a thousandth.
const FAR: f64 = 8192.0;

/// The farthest in units of what is small: squares of areas stay numbers.
const FARTHEST: f64 = (1u64 << 30) as f64;

/// Triangles that are looked at, about.
const LOOKS: usize = 1 << 16;

/// What is small lies between these quantiles of the triangles, weighted by one over their size.
const QUANTILES: [f64; 2] = [0.05, 0.95];

/// The centre of a triangle, and its weight: one over its size.
type Look = (DVec3, f64);

/// How the scene comes to the coordinates of the core, and whether it is cut there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    pub(super) transform: SceneTransform,
    pub(super) is_far: bool,
}

impl Fit {
    pub(super) fn of(parts: &[Placed]) -> Self {
        let (min, max) = bounds(parts);
        let longest = (0..3).map(|i| max[i] - min[i]).fold(0.0, f64::max);
        let plain = Self { transform: SceneTransform::fitting(min, max), is_far: false };
        let triangles: usize = parts.iter().map(|part| part.group.triangles.len()).sum();
        let step = triangles.div_ceil(LOOKS).max(1);
        let looks = parts.iter().flat_map(|part| {
            let corner = |v: u32| DVec3::from(part.placement.point(part.group.positions[v as usize]));
            let corners = part.group.triangles.iter().step_by(step).map(move |t| t.map(corner));
            corners.filter_map(|[p, q, r]| {
                let (low, high) = (p.min(q).min(r), p.max(q).max(r));
                let size = (high - low).max_element();
                (size > 0.0 && size.is_finite()).then_some((0.5 * low + 0.5 * high, 1.0 / size))
            })
        });
        let looks: Vec<Look> = looks.collect();
        let smallest = looks.iter().fold(0.0, |most, (_, weight)| f64::max(most, *weight)).recip();
        if !(longest > FAR * smallest && smallest > 0.0) {
            return plain;
        }
        let sum: f64 = looks.iter().map(|(_, weight)| weight).sum();
        let quantile = |value: &dyn Fn(&Look) -> f64, share| quantile(&looks, value, share * sum);
        let [low, high] =
            QUANTILES.map(|share| DVec3::from([0, 1, 2].map(|i| quantile(&|(center, _)| center[i], share))));
        let size = quantile(&|(_, weight)| 1.0 / weight, 0.5);
        let small = (high - low).max_element().max(size).max(longest / FARTHEST);
        if longest <= FAR * small {
            return plain;
        }
        let center = 0.5 * low + 0.5 * high;
        let corners = [-0.5, 0.5].map(|half| (center + half * small).to_array());
        Self { transform: SceneTransform::fitting(corners[0], corners[1]), is_far: true }
    }
}

/// The value up to which the weights of all triangles sum up to `share`.
fn quantile(looks: &[Look], value: impl Fn(&Look) -> f64, share: f64) -> f64 {
    let mut values: Vec<(f64, f64)> = looks.iter().map(|look| (value(look), look.1)).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sum = 0.0;
    let reached = values.iter().find(|(_, weight)| {
        sum += weight;
        sum >= share
    });
    reached.or(values.last()).map_or(0.0, |(value, _)| *value)
}
