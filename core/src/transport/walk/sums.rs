//! Multiple importance sampling of bidirectional techniques by running sums (Georgiev 2012, "Implementing
//! Vertex Connection and Merging", in étendue and with counts).
//!
//! A path x₀ … x_k from a light to the lens can be found by every technique: the camera walk hits the light,
//! a light sample, a connection of two vertices, a merge at one vertex, a splat of a light vertex. The
//! balance heuristic divides the count times the density of a technique by the sum over all of them, which
//! the three numbers of [`Sums`] of both subpaths give.
//!
//! A path is merged at one vertex at most (`bidirectional/merging.rs`): the first rough one from the camera,
//! if the vertex before it on the way from the light is a caster or near. Neither subpath knows both sides,
//! so the merge has a number of its own, `pending_merge`: the next rough vertex of a light path replaces it,
//! and a camera path adds it to `rest` if its next vertex is a caster or near.
//!
//! p is the density per solid angle with which a walk goes on, p← that of the opposite walk, c a cosine to
//! the geometric normal, d a distance, e the density of emission per étendue (`light/emission/pdf.rs`), q the
//! density of the rays of one pixel, η = L π r² the expected number of light paths in the disc of a merge
//! (`eta_vcm`). Roulette stays out of the weights, which add up to one without it.

use bytemuck::{Pod, Zeroable};

/// The running sums of one subpath.
///
/// | | `last` | `rest` | `pending_merge` |
/// |---|---|---|---|
/// | Georgiev's and SmallVCM's | dVCM | dVC = η dVM | the term η of one vertex in dVC |
/// | techniques | connects over the latest segment | all before it | merge at the latest rough vertex |
/// | lacks the factor | 1 | p← | p←, and 1 at the vertex of the merge |
/// | [`Sums::at_light`] | n p_light / (e c) | 1 / (e c), or 0 for delta lights | 0 |
/// | [`Sums::at_camera`] | L / q | 0 | 0 |
/// | [`Sums::arrive`] | · d² / c, or 0 at a delta vertex | / c | / c |
/// | [`Sums::scatter`] | n_C / p | c / p (last + rest p←) | c / p · pending p←, or c η / p if rough |
/// | [`Sums::scatter_delta`] | 0 | · c / n² | · c / n² |
///
/// SmallVCM merges at every vertex, so its dVC has a term η for each. Its densities of emission per area are
/// per étendue here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Sums {
    /// Technique that connects over the latest segment.
    pub last: f32,
    /// Techniques before it.
    pub rest: f32,
    /// Merge at the latest rough vertex, which the next vertex may make void.
    pub pending_merge: f32,
}

/// Expected uses of each technique for a sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// L: light paths of a sample of the picture; every vertex of them is splatted. 0 without splats.
    pub light_paths: f32,
    /// n_C: expected number of connections of a camera vertex to the vertices of one position in a light
    /// path, C L / M̄.
    pub connections: f32,
    /// Light samples of a camera vertex.
    pub light_samples: f32,
}

impl Counts {
    /// Those of path tracing.
    pub(crate) const PATH_TRACING: Self = Self { light_paths: 0.0, connections: 0.0, light_samples: 1.0 };
}

/// The way by which light comes to a vertex where it is merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Arrival {
    /// From a caster.
    FromCaster,
    /// From a rough vertex that is near.
    FromNear,
}

impl Arrival {
    /// From a caster, or from a rough vertex at this `squared` distance to one whose merges count η, by
    /// `MergeRadii::near`: about there merges and connections are as good as each other. `None` where light
    /// is not merged.
    #[inline]
    pub(crate) fn of(from_caster: bool, squared: f32, near: f32) -> Option<Self> {
        match from_caster {
            true => Some(Arrival::FromCaster),
            false => (squared < near).then_some(Arrival::FromNear),
        }
    }

    /// True if light is merged that comes so to the vertex at the end of segment `segments` of a camera path.
    #[inline]
    pub(crate) fn is_merged(self, segments: u32) -> bool {
        self == Arrival::FromCaster || segments > 1
    }
}

impl Sums {
    /// Sums of a light path that arrives at its first vertex, whose light has density `pdf_light` for a light
    /// sample there (a probability for lights without extent) and `emission` per étendue.
    #[inline]
    pub(crate) fn at_light(
        counts: &Counts,
        pdf_light: f32,
        emission: f32,
        cos_in: f32,
        can_be_hit: bool,
    ) -> Self {
        let inverse = 1.0 / (emission * cos_in);
        Self {
            last: counts.light_samples * pdf_light * inverse,
            rest: if can_be_hit { inverse } else { 0.0 },
            pending_merge: 0.0,
        }
    }

    /// Sums of a camera path that leaves the lens by a ray of density `pdf_pixel` among those of its pixel.
    #[inline]
    pub(crate) fn at_camera(counts: &Counts, pdf_pixel: f32) -> Self {
        Self { last: counts.light_paths / pdf_pixel, rest: 0.0, pending_merge: 0.0 }
    }

    /// At the end of a segment. The first segment of a light path is in [`Sums::at_light`].
    #[inline]
    pub(crate) fn arrive(self, distance_squared: f32, cos_in: f32, is_delta: bool) -> Self {
        Self {
            last: if is_delta { 0.0 } else { self.last * distance_squared / cos_in },
            rest: self.rest / cos_in,
            pending_merge: self.pending_merge / cos_in,
        }
    }

    /// Sums of a camera path that can be merged at the vertex before, as this vertex shows.
    #[inline]
    pub(crate) fn with_merge(self) -> Self {
        Self { rest: self.rest + self.pending_merge, pending_merge: 0.0, ..self }
    }

    /// After scattering with density `pdf`; `reverse` is the density of the opposite walk, `eta_vcm` the
    /// count of merges there if the vertex is rough.
    #[inline]
    pub(crate) fn scatter(
        self,
        counts: &Counts,
        pdf: f32,
        reverse: f32,
        cos_out: f32,
        eta_vcm: Option<f32>,
    ) -> Self {
        Self {
            last: counts.connections / pdf,
            rest: cos_out / pdf * self.before(reverse),
            pending_merge: cos_out / pdf * eta_vcm.unwrap_or(self.pending_merge * reverse),
        }
    }

    /// After reflection or refraction by a delta lobe; `eta` is the index behind over that before, in the
    /// walk's direction. Refraction keeps n² dA cos dω.
    #[inline]
    pub(crate) fn scatter_delta(self, cos_in: f32, eta: f32) -> Self {
        let factor = cos_in / (eta * eta);
        Self { last: 0.0, rest: self.rest * factor, pending_merge: self.pending_merge * factor }
    }

    /// All techniques of this subpath, where the opposite walk goes on with density `reverse` at the latest
    /// vertex.
    #[inline]
    pub(crate) fn before(&self, reverse: f32) -> f32 {
        self.last + self.rest * reverse
    }
}

/// Weight of emission that a camera path hits, whose `sums` are those after its latest scattering. `pdf` is
/// that of the direction, `None` after a delta lobe; `pdf_light` and `emission` as in [`Sums::at_light`].
#[inline]
pub(crate) fn weight_of_hit(
    counts: &Counts,
    sums: &Sums,
    pdf: Option<f32>,
    pdf_light: f32,
    emission: f32,
) -> f32 {
    let by_light_sample = pdf.map_or(0.0, |pdf| counts.light_samples * pdf_light / pdf);
    weight(1.0, by_light_sample + emission * sums.rest)
}

/// Weight of a light sample at a camera vertex with `sums` on arrival. `pdf` is the density with which the
/// walk would hit the light, 0 if it cannot; `emission_per_pdf` the density of emission over that of the
/// sample; `reverse` the density of the walk from the light through the vertex to the one before.
#[inline]
pub(crate) fn weight_of_light_sample(
    counts: &Counts,
    sums: &Sums,
    (pdf, pdf_light): (f32, f32),
    emission: f32,
    (cos, reverse): (f32, f32),
) -> f32 {
    let by_light_paths = emission * cos / pdf_light * sums.before(reverse);
    weight(counts.light_samples, pdf / pdf_light + by_light_paths)
}

/// One end of a connection: the sums of its subpath on arrival, and densities at its vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// Sums on arrival.
    pub sums: Sums,
    /// Density per solid angle of the direction to the other end.
    pub pdf: f32,
    /// Density per solid angle of the direction to the vertex before, of a walk that comes from the other
    /// end.
    pub reverse: f32,
    /// Cosine of the direction to the other end.
    pub cos: f32,
    /// Merge of the whole path on this side of the connection; 0 where there is none.
    pub merge: f32,
}

impl End {
    /// All techniques on this side.
    fn before(&self) -> f32 {
        self.sums.before(self.reverse) + self.merge
    }
}

/// Weight of a connection of a camera vertex with a light vertex.
#[inline]
pub(crate) fn weight_of_connection(counts: &Counts, camera: &End, light: &End, distance_squared: f32) -> f32 {
    let per_area = |from: &End, to: &End| from.pdf * to.cos / distance_squared;
    let by_camera = per_area(camera, light) * light.before();
    let by_light = per_area(light, camera) * camera.before();
    weight(counts.connections, by_camera + by_light)
}

/// Weight of the splat of a light vertex. `pdf_area` is the density per area with which rays of the pixel
/// meet it, `reverse` the density of the walk from the lens to the vertex before, `merge` the merge of the
/// path, or 0.
#[inline]
pub(crate) fn weight_of_splat(counts: &Counts, sums: &Sums, pdf_area: f32, reverse: f32, merge: f32) -> f32 {
    weight(counts.light_paths, pdf_area * (sums.before(reverse) + merge))
}

/// Weight of the merge of two subpaths that have arrived at one vertex, in whose disc `eta_vcm` light paths
/// are expected. Each has its sums and the density of the opposite walk to the vertex before.
#[inline]
pub(crate) fn weight_of_merge(
    eta_vcm: f32,
    (camera, pdf_to_camera): (&Sums, f32),
    (light, pdf_to_light): (&Sums, f32),
) -> f32 {
    weight(eta_vcm, camera.before(pdf_to_camera) + light.before(pdf_to_light))
}

/// `own` over the sum of `own` and `others`; 0 where that is not a number.
#[inline]
fn weight(own: f32, others: f32) -> f32 {
    let weight = own / (own + others);
    if weight.is_finite() { weight } else { 0.0 }
}

#[cfg(test)]
mod tests;
