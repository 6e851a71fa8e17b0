//! Division of a range of references at the least cost of the surface area heuristic (Goldsmith, Salmon 1987)
//! over binned centroids (Wald 2007).

use super::references::Reference;
use glam::{Vec3, Vec4, Vec4Swizzles};
use halflight_simd::{Kernel, Level, Simd};

/// Box in registers; `w` is unused.
#[derive(Clone, Copy)]
pub(super) struct Box4 {
    pub lo: Vec4,
    pub hi: Vec4,
}

impl Box4 {
    pub(super) const EMPTY: Box4 = Box4 { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    #[inline(always)]
    fn grow(&mut self, other: &Box4) {
        self.lo = self.lo.min(other.lo);
        self.hi = self.hi.max(other.hi);
    }

    #[inline(always)]
    fn half_area(&self) -> f32 {
        let e = (self.hi - self.lo).xyz();
        e.x * (e.y + e.z) + e.y * e.z
    }
}

/// Bounds of some references and of their doubled centroids (lo + hi).
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub boxes: Box4,
    pub centroids: Box4,
}

impl Extent {
    pub(super) const EMPTY: Extent = Extent { boxes: Box4::EMPTY, centroids: Box4::EMPTY };

    #[inline(always)]
    fn grow(&mut self, r: &Reference) {
        let centroid = r.lo + r.hi;
        self.boxes.grow(&Box4 { lo: r.lo, hi: r.hi });
        self.centroids.grow(&Box4 { lo: centroid, hi: centroid });
    }

    #[inline(always)]
    pub(super) fn of(references: &[Reference]) -> Self {
        let mut extent = Self::EMPTY;
        for r in references {
            extent.grow(r);
        }
        extent
    }
}

/// Best cut: the left side gets the bins below `bin` of `axis`.
#[derive(Clone, Copy)]
struct Cut {
    cost: f32,
    axis: usize,
    bin: usize,
}

/// Map from a centroid to its bin, on all axes.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec4,
    scale: Vec3,
}

impl Binning {
    #[inline(always)]
    fn new(centroids: &Box4, bins: usize) -> Self {
        let extent = (centroids.hi - centroids.lo).xyz();
        // Slightly below the number of bins, so that the largest centroid falls into the last bin.
        let scale = bins as f32 * (1.0 - 1e-5) / extent;
        let usable = scale.is_finite_mask() & extent.cmpgt(Vec3::ZERO);
        Self { origin: centroids.lo, scale: Vec3::select(usable, scale, Vec3::ZERO) }
    }

    #[inline(always)]
    fn bin(&self, r: &Reference, axis: usize, bins: usize) -> usize {
        let along = ((r.lo[axis] + r.hi[axis]) - self.origin[axis]) * self.scale[axis];
        (along as usize).min(bins - 1)
    }
}

/// Divides `references` and returns the number on the left, with the extents of both sides. Each side of two
/// or more references gets at least one.
pub(super) fn divide(level: Level, references: &mut [Reference], extent: &Extent) -> (usize, Extent, Extent) {
    if references.len() == 2 {
        return halve(references);
    }
    level.dispatch(Divide { references, extent })
}

/// Kernel of one division. All levels compute alike, so that the tree is the same; only the encoding differs.
struct Divide<'a> {
    references: &'a mut [Reference],
    extent: &'a Extent,
}

impl Kernel for Divide<'_> {
    type Out = (usize, Extent, Extent);

    #[inline(always)]
    fn run<S: Simd>(self, _simd: S) -> Self::Out {
        let Self { references, extent } = self;
        if references.len() <= 32 {
            divide_binned::<8>(references, extent)
        } else {
            divide_binned::<16>(references, extent)
        }
    }
}

#[inline(always)]
fn divide_binned<const BINS: usize>(
    references: &mut [Reference],
    extent: &Extent,
) -> (usize, Extent, Extent) {
    let binning = Binning::new(&extent.centroids, BINS);
    match best_cut::<BINS>(references, &binning) {
        Some(cut) => partition::<BINS>(references, &binning, cut),
        None => halve(references),
    }
}

/// Bins all references on all axes and sweeps for the cut of least cost.
#[inline(always)]
fn best_cut<const BINS: usize>(references: &[Reference], binning: &Binning) -> Option<Cut> {
    let mut bins = [[(Box4::EMPTY, 0u32); BINS]; 3];
    for r in references {
        let along = (r.lo + r.hi - binning.origin).xyz() * binning.scale;
        let boxed = Box4 { lo: r.lo, hi: r.hi };
        for axis in 0..3 {
            let (bounds, count) = &mut bins[axis][(along[axis] as usize).min(BINS - 1)];
            bounds.grow(&boxed);
            *count += 1;
        }
    }

    let mut best: Option<Cut> = None;
    for (axis, bins) in bins.iter().enumerate() {
        if binning.scale[axis] == 0.0 {
            continue;
        }
        let mut right_cost = [0.0f32; BINS];
        let (mut side, mut count) = (Box4::EMPTY, 0);
        for bin in (1..BINS).rev() {
            side.grow(&bins[bin].0);
            count += bins[bin].1;
            right_cost[bin] = if count > 0 { count as f32 * side.half_area() } else { f32::NAN };
        }
        (side, count) = (Box4::EMPTY, 0);
        for bin in 1..BINS {
            side.grow(&bins[bin - 1].0);
            count += bins[bin - 1].1;
            if count == 0 {
                continue;
            }
            // NaN if the right side is empty: never the best.
            let cost = count as f32 * side.half_area() + right_cost[bin];
            if best.map_or(cost < f32::INFINITY, |b| cost < b.cost) {
                best = Some(Cut { cost, axis, bin });
            }
        }
    }
    best
}

/// Moves the references on the left of a cut to the front.
#[inline(always)]
fn partition<const BINS: usize>(
    references: &mut [Reference],
    binning: &Binning,
    cut: Cut,
) -> (usize, Extent, Extent) {
    let (mut left, mut right) = (Extent::EMPTY, Extent::EMPTY);
    let (mut i, mut j) = (0, references.len());
    while i < j {
        let r = references[i];
        if binning.bin(&r, cut.axis, BINS) < cut.bin {
            left.grow(&r);
            i += 1;
        } else {
            right.grow(&r);
            j -= 1;
            references.swap(i, j);
        }
    }
    if i == 0 || i == references.len() { halve(references) } else { (i, left, right) }
}

/// Halves by count, for references that no plane separates.
#[inline(always)]
pub(super) fn halve(references: &[Reference]) -> (usize, Extent, Extent) {
    let (left, right) = references.split_at(references.len() / 2);
    (left.len(), Extent::of(left), Extent::of(right))
}
