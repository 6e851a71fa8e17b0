//! Choice of origin and scale. The core computes in f32, which is densest at the origin, so the origin is
//! usually the centre of the bounding box. If a few large triangles (a ground, a sun) extend much further
//! than the detail, the detail determines origin and scale, and large triangles are cut ([`super::split`]).

use super::placed::{Placed, bounds};
use super::transform::SceneTransform;
use glam::DVec3;

/// Ratio of the extents of scene and detail above which the detail decides. f32 would round the detail to a
/// thousandth of its size.
const FAR: f64 = 8192.0;

/// Largest extent over the detail: squares of areas stay finite.
const FARTHEST: f64 = (1u64 << 30) as f64;

/// Triangles that are examined, approximately.
const SAMPLES: usize = 1 << 16;

/// The detail lies between these quantiles of the triangles, weighted by one over their size.
const QUANTILES: [f64; 2] = [0.05, 0.95];

/// Centre of a triangle, and its weight: one over its size.
type Sample = (DVec3, f64);

/// Transform to the coordinates of the core; whether large triangles are cut there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    pub(super) transform: SceneTransform,
    pub(super) is_far: bool,
}

impl Fit {
    pub(super) fn of(parts: &[Placed]) -> Self {
        let (min, max) = bounds(parts);
        let longest = (max - min).max_element().max(0.0);
        let plain = Self { transform: SceneTransform::fitting(min.into(), max.into()), is_far: false };
        let triangles: usize = parts.iter().map(|part| part.group.triangles.len()).sum();
        let step = triangles.div_ceil(SAMPLES).max(1);
        let samples = parts.iter().flat_map(|part| {
            let corner = |v: u32| DVec3::from(part.placement.point(part.group.positions[v as usize]));
            let corners = part.group.triangles.iter().step_by(step).map(move |t| t.map(corner));
            corners.filter_map(|[p, q, r]| {
                let (low, high) = (p.min(q).min(r), p.max(q).max(r));
                let size = (high - low).max_element();
                (size > 0.0 && size.is_finite()).then_some((0.5 * low + 0.5 * high, 1.0 / size))
            })
        });
        let samples: Vec<Sample> = samples.collect();
        let smallest = samples.iter().fold(0.0, |most, (_, weight)| f64::max(most, *weight)).recip();
        if !(longest > FAR * smallest && smallest > 0.0) {
            return plain;
        }
        let sum: f64 = samples.iter().map(|(_, weight)| weight).sum();
        let quantile = |value: &dyn Fn(&Sample) -> f64, part| quantile(&samples, value, part * sum);
        let [low, high] =
            QUANTILES.map(|part| DVec3::from([0, 1, 2].map(|i| quantile(&|(center, _)| center[i], part))));
        let size = quantile(&|(_, weight)| 1.0 / weight, 0.5);
        let detail = (high - low).max_element().max(size).max(longest / FARTHEST);
        if longest <= FAR * detail {
            return plain;
        }
        let center = 0.5 * low + 0.5 * high;
        let [low, high] = [-0.5, 0.5].map(|half| (center + half * detail).to_array());
        Self { transform: SceneTransform::fitting(low, high), is_far: true }
    }
}

/// The value at which the sum of the weights of smaller values reaches `weight`.
fn quantile(samples: &[Sample], value: impl Fn(&Sample) -> f64, weight: f64) -> f64 {
    let mut values: Vec<(f64, f64)> = samples.iter().map(|sample| (value(sample), sample.1)).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sum = 0.0;
    let at = values.iter().find(|(_, own)| {
        sum += own;
        sum >= weight
    });
    at.or(values.last()).map_or(0.0, |(value, _)| *value)
}
