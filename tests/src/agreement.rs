//! Agreement of a method with path tracing on one scene, by blocks of pixels and by the mean of the picture.

use crate::references::reference;
use crate::render::{blocks_of, render};
use crate::scenes::SceneBuffers;
use crate::statistics::agree_within;
use halflight::render::{Method, RenderResult, Settings};

/// Independent pictures of each method.
const REPLICAS: u32 = 8;

/// Samples per pixel of a stored picture of path tracing, and of a picture of the other method.
const SPP: [u32; 2] = [512, 32];

/// Largest relative bias of the picture's mean.
const BIAS_OF_MEAN: f64 = 0.003;

/// Pictures of a square size, and the bias that blocks may have.
#[derive(Clone, Copy)]
pub struct Agreement {
    /// Pixels along a side of the picture, and of a block.
    pub size: u32,
    /// See `size`.
    pub block: u32,
    /// Largest bias of a block, as a share of its light plus a tenth of the mean.
    pub bias: f64,
    /// Comparisons of the test, for the level of significance.
    pub comparisons: usize,
}

impl Agreement {
    /// Asserts that pictures of `method` agree with the stored ones of path tracing in `scene`; `check` sees
    /// each picture of the method.
    #[track_caller]
    pub fn assert(&self, scene: (&str, &SceneBuffers), method: Method, check: impl Fn(&RenderResult)) {
        self.assert_with(scene, method, |_| (), check);
    }

    /// [`Agreement::assert`] with changed settings.
    #[track_caller]
    pub fn assert_with(
        &self,
        (name, buffers): (&str, &SceneBuffers),
        method: Method,
        change: impl Fn(&mut Settings),
        check: impl Fn(&RenderResult),
    ) {
        let values = |method, spp, change: &dyn Fn(&mut Settings), check: &dyn Fn(&RenderResult)| {
            let one = |seed| {
                let result = render(&buffers.scene(), method, self.size, spp, |s| {
                    s.seed = seed;
                    change(s);
                });
                assert_eq!(result.counters.dropped.total(), 0);
                check(&result);
                let mut values = blocks_of(&result.image, self.block);
                values.push(values.iter().sum::<f64>() / values.len() as f64);
                values
            };
            (0..REPLICAS).map(one).collect::<Vec<_>>()
        };
        let path = reference(&format!("{name}, blocks of {}", self.block), || {
            values(Method::Path, SPP[0], &|_| (), &|_| ())
        });
        let found = values(method, SPP[1], &change, &check);
        let last = path.moments.len() - 1;
        let light = path.moments[last].0;
        let allowed =
            |i: usize, b: f64| if i < last { self.bias * (b + 0.1 * light) } else { BIAS_OF_MEAN * b };
        agree_within(&found, &path, self.comparisons, allowed).unwrap_or_else(|why| panic!("{why}"));
    }
}
