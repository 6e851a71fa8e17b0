//! Derivatives of irradiance from the triangulated environment (Schwarzhaupt, Jensen, Jarosz 2012): the
//! samples of a hemisphere's n × n strata are the vertices of a mesh, and each quad of neighbours is two
//! triangles.
//!
//! Each triangle has one radiance, and its three edges are summed. Departures:
//! 1. Each edge is summed once, times the jump of radiance from the triangle on its right to that on its
//!    left. This is half the work, and equal radiance on both sides cancels before any computation.
//! 2. The rim. The mesh ends above the horizon, where no sample lies. An open rim, as in the paper, is the
//!    boundary of a false light against a black sky. The triangles of a closed rim extend to the horizon,
//!    where edges contribute nothing: edges of the rim are simply left out.
//! 3. The radiance of a triangle is that of its farthest vertex, as in the paper. This is right where an
//!    occluder's edge crosses the triangle, and as wrong as any vertex within a patch of radiance of one
//!    wall. Alternatively the radiance is the mean over the vertices at about the distance of the farthest.
//!
//! The cost: edges longer than a right angle, which only coarse hemispheres have, are computed one by one.

use super::edge::{Flux, flux, flux_of};
use super::jumps::{Lanes16, Row, SIDE_MAX, Sums, sixteen};
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};

/// Radiance of the mesh's triangles, and its rim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Radiance of the farthest vertex, and an open rim, as in the paper.
    Farthest,
    /// Mean over the vertices up to [`AS_FAR`] times nearer than the farthest, and a closed rim.
    DepthAware,
}

/// Vertices of a triangle whose distances differ by less than this factor belong to one surface.
pub const AS_FAR: f32 = 1.25;

/// Samples of n × n strata, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Strata along a side, at most [`SIDE_MAX`].
    pub n: usize,
    /// Radiance.
    pub radiance: &'a [[f32; 3]],
    /// 1/distance.
    pub inverse_distance: &'a [f32],
    /// Unit directions.
    pub directions: &'a [[f32; 3]],
    /// Rule for the radiance of triangles and the rim.
    pub rule: Rule,
}

/// Vertex: direction, inverse distance, radiance.
type Vertex<L> = ([L; 3], L, [L; 3]);

/// Radiance of the triangle of three vertices.
#[inline(always)]
fn radiance<L: Lanes>(
    all: impl Fn(f32) -> L,
    rule: Rule,
    [(_, u, p), (_, v, q), (_, w, r)]: [&Vertex<L>; 3],
) -> [L; 3] {
    let farthest = u.min(*v).min(*w);
    let (zero, one) = (all(0.0), all(1.0));
    let limit = match rule {
        Rule::Farthest => farthest,
        Rule::DepthAware => farthest * all(AS_FAR),
    };
    let (first, second, third) = (u.le(limit), v.le(limit), w.le(limit));
    let (mut a, mut b, mut c) = (one.select(first, zero), one.select(second, zero), one.select(third, zero));
    match rule {
        // The first of equally distant vertices.
        Rule::Farthest => {
            b = zero.select(first, b);
            c = zero.select(first | second, c);
        }
        Rule::DepthAware => {
            let inverse = one / (a + b + c).max(one);
            (a, b, c) = (a * inverse, b * inverse, c * inverse);
        }
    }
    [a * p[0] + b * q[0] + c * r[0], a * p[1] + b * q[1] + c * r[1], a * p[2] + b * q[2] + c * r[2]]
}

impl Mesh<'_> {
    /// Sums of derivatives; data missing from short slices contributes zero.
    pub fn sums(self, level: Level) -> Sums {
        level.dispatch(self)
    }

    /// Vertex of a stratum.
    fn vertex(&self, i: usize, j: usize) -> Option<Vertex<f32>> {
        let at = (i < self.n && j < self.n).then_some(i * self.n + j)?;
        Some((*self.directions.get(at)?, *self.inverse_distance.get(at)?, *self.radiance.get(at)?))
    }

    /// Scalar reference, triangle by triangle, without the rim's edges of a closed mesh. Equals
    /// [`Mesh::sums`] except for the order of the sums.
    pub fn reference(self) -> Sums {
        let (n, mut sums) = (self.n.min(SIDE_MAX), Sums::default());
        for (i, j) in (1..n).flat_map(|i| (1..n).map(move |j| (i - 1, j - 1))) {
            let corners = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)];
            for (p, q, r) in [(0, 1, 2), (0, 2, 3)] {
                let places = [corners[p], corners[q], corners[r]];
                let [Some(a), Some(b), Some(c)] = places.map(|(i, j)| self.vertex(i, j)) else { continue };
                let radiance = radiance(|x| x, self.rule, [&a, &b, &c]);
                for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                    let (places, [a, b]) = ([places[from], places[to]], [[a, b, c][from], [a, b, c][to]]);
                    let along = |side: usize| {
                        places.iter().all(|p| p.0 == side) || places.iter().all(|p| p.1 == side)
                    };
                    let rim = along(0) || along(n - 1);
                    if self.rule == Rule::Farthest || !rim {
                        sums.add(radiance, &flux_of(a.0, a.1, b.0, b.1));
                    }
                }
            }
        }
        sums
    }
}

/// Rows of seven numbers: direction, inverse distance, radiance.
type Vertices = [Row; 7];
/// Rows of three channels.
type Triangles = [Row; 3];

/// Empty row.
const EMPTY: Row = [0.0; SIDE_MAX + 32];

impl Kernel for Mesh<'_> {
    type Out = Sums;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Sums {
        let n = self.n.min(SIDE_MAX);
        let mut work = Work { simd, sums: Lanes16::new(simd.splat16(0.0)), long: Sums::default() };
        let (mut here, mut above) = ([EMPTY; 7], [EMPTY; 7]);
        // Triangles of a row of quads on the right and on the left of the diagonal, and the left triangles of
        // the row below.
        let (mut right, mut left, mut below) = ([EMPTY; 3], [EMPTY; 3], [EMPTY; 3]);
        let closed = self.rule == Rule::DepthAware;
        self.vertices(0, &mut here);
        for i in 0..n {
            self.vertices(i + 1, &mut above);
            if i + 1 < n {
                for start in (1..n).step_by(16) {
                    work.triangles(self.rule, [&here, &above], start, [&mut right, &mut left]);
                }
                // Beyond its last quad a row has no triangles: radiance is zero, or that of the adjacent
                // triangle if the rim is closed.
                for (right, left) in right.iter_mut().zip(&mut left) {
                    right[0] = if closed { left[1] } else { 0.0 };
                    right[n..].fill(0.0);
                    left[n..].fill(0.0);
                    left[n] = if closed { right[n - 1] } else { 0.0 };
                }
            } else {
                right = if closed { below } else { [EMPTY; 3] };
                left = [EMPTY; 3];
            }
            if i == 0 && closed {
                below = right;
            }
            for start in (1..n + 1).step_by(16) {
                let row = [&here, &above];
                // Bottom edges of the quads, from this vertex to the next.
                work.edges(row[0], start, row[0], start + 1, (&right, start), (&below, start));
                if i + 1 < n {
                    // Diagonals and left edges.
                    work.edges(row[0], start, row[1], start + 1, (&left, start), (&right, start));
                    work.edges(row[0], start, row[1], start, (&right, start - 1), (&left, start));
                }
            }
            core::mem::swap(&mut here, &mut above);
            below = left;
        }
        work.total()
    }
}

impl Mesh<'_> {
    /// Copies row `i`, number by number.
    #[inline(always)]
    fn vertices(&self, i: usize, rows: &mut Vertices) {
        let [x, y, z, u, r, g, b] = rows;
        let (skip, n) = (i * self.n, self.n);
        let samples = self.directions.iter().zip(self.inverse_distance).zip(self.radiance);
        for (j, ((direction, inverse), radiance)) in (1..=SIDE_MAX).zip(samples.skip(skip).take(n)) {
            ([x[j], y[j], z[j]], u[j], [r[j], g[j], b[j]]) = (*direction, *inverse, *radiance);
        }
    }
}

struct Work<S: Simd> {
    simd: S,
    sums: Lanes16<S::F16>,
    /// Sums over edges longer than a right angle.
    long: Sums,
}

impl<S: Simd> Work<S> {
    /// Sixteen numbers of a row.
    #[inline(always)]
    fn load(&self, row: &Row, start: usize) -> S::F16 {
        self.simd.load16(sixteen(row, start))
    }

    #[inline(always)]
    fn vertex(&self, [x, y, z, u, r, g, b]: &Vertices, at: usize) -> Vertex<S::F16> {
        let direction = [self.load(x, at), self.load(y, at), self.load(z, at)];
        (direction, self.load(u, at), [self.load(r, at), self.load(g, at), self.load(b, at)])
    }

    /// Radiance of the triangles of sixteen quads, from the quad at vertices `start` on.
    #[inline(always)]
    fn triangles(
        &self,
        rule: Rule,
        [here, above]: [&Vertices; 2],
        start: usize,
        [right, left]: [&mut Triangles; 2],
    ) {
        let all = |value| self.simd.splat16(value);
        let (a, b) = (self.vertex(here, start), self.vertex(here, start + 1));
        let (c, d) = (self.vertex(above, start + 1), self.vertex(above, start));
        store(right, start, radiance(all, rule, [&a, &b, &c]));
        store(left, start, radiance(all, rule, [&a, &c, &d]));
    }

    /// Adds sixteen edges from vertices of one row to vertices of another, with the triangles on both sides.
    #[inline(always)]
    fn edges(
        &mut self,
        from: &Vertices,
        first: usize,
        to: &Vertices,
        second: usize,
        (left, l): (&Triangles, usize),
        (right, r): (&Triangles, usize),
    ) {
        let all = |value| self.simd.splat16(value);
        let jump = [
            self.load(&left[0], l) - self.load(&right[0], r),
            self.load(&left[1], l) - self.load(&right[1], r),
            self.load(&left[2], l) - self.load(&right[2], r),
        ];
        let ((a, u, _), (b, v, _)) = (self.vertex(from, first), self.vertex(to, second));
        let cos = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let long = cos.lt(all(0.0));
        if long.any() {
            for lane in (0..16).filter(|lane| long.bits() >> lane & 1 == 1) {
                let at = |rows: &Vertices, at: usize| {
                    let [x, y, z, u, ..] = rows;
                    let at = |row: &Row| row.get(at + lane).copied().unwrap_or(0.0);
                    ([at(x), at(y), at(z)], at(u))
                };
                let ((a, u), (b, v)) = (at(from, first), at(to, second));
                let [r, g, b_] = [jump[0].to_array(), jump[1].to_array(), jump[2].to_array()];
                let jump = [r[lane], g[lane], b_[lane]];
                if jump != [0.0; 3] {
                    self.long.add(jump, &flux_of(a, u, b, v));
                }
            }
        }
        // A long edge becomes an edge of length zero.
        let b = [a[0].select(long, b[0]), a[1].select(long, b[1]), a[2].select(long, b[2])];
        let flux: Flux<S::F16> = flux(all, a, u, b, v);
        self.sums.add(all, jump, &flux);
    }

    #[inline(always)]
    fn total(&self) -> Sums {
        let (mut total, long) = (self.sums.total(), &self.long);
        for channel in 0..3 {
            for axis in 0..2 {
                total.gradient[channel][axis] += long.gradient[channel][axis];
                total.rotation[channel][axis] += long.rotation[channel][axis];
            }
        }
        for (total, long) in total.hessian.iter_mut().zip(long.hessian) {
            *total += long;
        }
        total
    }
}

/// Sixteen triangles of a row.
#[inline(always)]
fn store<L: Lanes<Array = [f32; 16]>>([r, g, b]: &mut Triangles, start: usize, radiance: [L; 3]) {
    for (row, lanes) in [r, g, b].into_iter().zip(radiance) {
        if let Some(row) = row.get_mut(start..start + 16) {
            row.copy_from_slice(&lanes.to_array());
        }
    }
}
