//! The densities of all techniques for one path, written down.

use super::Reference;
use crate::bsdf::BsdfSample;
use crate::geometry::Hit;
use crate::light::LightType;
use crate::scene::SurfacePoint;
use crate::transport::walk::sums::Arrival;
use crate::transport::walk::vertex::{Scatterer, is_bent_at};
use glam::Vec3;

/// Segments of a path at most.
pub const MOST_SEGMENTS: usize = 16;

/// Techniques: by the number of vertices on the side of the light, and the merge.
type Techniques = [f64; MOST_SEGMENTS + 2];

/// Number of the merge among them.
const MERGE: usize = MOST_SEGMENTS + 1;

/// Start of a path.
#[derive(Clone, Copy, Default)]
pub(super) struct Light {
    /// Number of the light.
    pub index: u32,
    /// Its point, where it has a surface.
    pub position: Option<Vec3>,
    /// Unit direction from the first vertex to any other light.
    pub to_light: Vec3,
}

impl Light {
    /// A point of a light that has a surface.
    pub(super) fn near(index: u32, position: Vec3) -> Self {
        Self { index, position: Some(position), to_light: Vec3::ZERO }
    }

    /// A light seen in unit direction `to_light`.
    pub(super) fn far(index: u32, to_light: Vec3) -> Self {
        Self { index, position: None, to_light }
    }
}

/// A vertex between light and lens.
#[derive(Clone, Copy, Default)]
pub(super) struct PathVertex {
    pub position: Vec3,
    pub triangle: u32,
    pub barycentric: [f32; 2],
    /// Left by a delta lobe.
    pub is_delta: bool,
    /// Index of refraction on the side of the camera over that on the side of the light.
    pub eta: f64,
}

impl PathVertex {
    pub(super) fn at(point: &SurfacePoint, hit: &Hit) -> Self {
        let Hit { u, v, triangle, .. } = *hit;
        Self { position: point.position, triangle, barycentric: [u, v], is_delta: false, eta: 1.0 }
    }

    /// The path goes on by `sample`; `eta` is the index on the side of the camera over that of the light's.
    pub(super) fn leave(&mut self, sample: &BsdfSample, eta: f32) {
        (self.is_delta, self.eta) = (sample.delta, f64::from(eta));
    }
}

/// A path x₀ … x_k from a light to the lens.
pub(super) struct Path {
    light: Light,
    /// x₁ … x_{k-1}.
    vertices: [PathVertex; MOST_SEGMENTS],
    count: usize,
    lens: [f32; 2],
}

impl Path {
    /// Path of the vertices of a light subpath, and those of a camera subpath from the lens on, whose ends
    /// are connected: neither end is left by a delta lobe. `None` where they are too many.
    pub(super) fn joined(
        light: Light,
        from_light: &[PathVertex],
        from_camera: &[PathVertex],
        lens: [f32; 2],
    ) -> Option<Self> {
        let count = from_light.len() + from_camera.len();
        let mut vertices = [PathVertex::default(); MOST_SEGMENTS];
        let slots = vertices.get_mut(..count)?;
        let all = from_light.iter().chain(from_camera.iter().rev());
        slots.iter_mut().zip(all).for_each(|(slot, vertex)| *slot = *vertex);
        if !from_light.is_empty() {
            vertices[from_light.len() - 1].is_delta = false;
        }
        Some(Self { light, vertices, count, lens })
    }

    /// Unit direction from x_i to x_j, its neighbour, and their squared distance.
    fn towards(&self, i: usize, j: usize) -> ([f64; 3], f64) {
        let at = |i: usize| wide(self.vertices[i - 1].position);
        let end = self.light.position.map(wide);
        match (i, j) {
            (0, _) | (_, 0) => {
                let Some(light) = end else {
                    let away = wide(self.light.to_light);
                    return (if j == 0 { away } else { away.map(|x| -x) }, 1.0);
                };
                if j == 0 { unit(at(i), light) } else { unit(light, at(j)) }
            }
            _ => unit(at(i), at(j)),
        }
    }
}

fn wide(v: Vec3) -> [f64; 3] {
    v.to_array().map(f64::from)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Unit direction from `a` to `b`, and their squared distance.
fn unit(a: [f64; 3], b: [f64; 3]) -> ([f64; 3], f64) {
    let between = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let squared = dot(between, between);
    (between.map(|x| x / libm::sqrt(squared)), squared)
}

fn narrow(v: [f64; 3]) -> Vec3 {
    Vec3::from(v.map(|x| x as f32))
}

/// A vertex with all that techniques depend on.
#[derive(Clone, Copy, Default)]
struct At {
    /// Cosines to x_{i-1} and to x_{i+1}.
    cos: [f64; 2],
    /// Density per solid angle of the light walk on to x_{i+1}, and of the camera walk on to x_{i-1}.
    pdf: [f64; 2],
    is_delta: bool,
    eta: f64,
    is_caster: bool,
    /// η.
    merges: f64,
    arrival: Option<Arrival>,
    /// The light walk cannot come here.
    is_bent: bool,
}

impl Reference<'_> {
    /// Weight of the technique with `count` vertices on the side of the light.
    pub(super) fn weight(&self, path: &Path, count: usize) -> f32 {
        let all = self.densities(path).unwrap_or([0.0; MOST_SEGMENTS + 2]);
        let weight = all[count] / all.iter().sum::<f64>();
        if weight.is_finite() { weight as f32 } else { 0.0 }
    }

    /// Vertex x_i, whose light comes from x_{i-1}, a caster if `from_caster`.
    fn at(&self, path: &Path, i: usize, lens: Vec3, from_caster: bool) -> Option<At> {
        let vertex = &path.vertices[i - 1];
        let (to_light, squared) = path.towards(i, i - 1);
        let to_camera = match i == path.count {
            true => unit(wide(vertex.position), wide(lens)).0,
            false => path.towards(i, i + 1).0,
        };
        let by_light = self.seen_along(vertex, -narrow(to_light))?;
        let by_camera = self.seen_along(vertex, -narrow(to_camera))?;
        let density = |(point, bsdf): (SurfacePoint, crate::bsdf::Bsdf), from: [f64; 3], to: [f64; 3]| {
            let [wo, wi] = [from, to].map(|way| point.frame.to_local(narrow(way)));
            f64::from(bsdf.evaluate::<crate::bsdf::All>(wo, wi).1)
        };
        let cos = |way: [f64; 3]| dot(way, wide(by_camera.0.geometric_normal)).abs();
        let (merges, arrival) = match i > 1 {
            true => self.merge((&by_camera.0, &by_camera.1), squared, from_caster),
            false => (0.0, None),
        };
        Some(At {
            cos: [cos(to_light), cos(to_camera)],
            pdf: [density(by_light, to_light, to_camera), density(by_camera, to_camera, to_light)],
            is_delta: vertex.is_delta,
            eta: vertex.eta,
            is_caster: vertex.is_delta || by_camera.1.is_caustic_caster(),
            merges,
            arrival,
            is_bent: is_bent_at(&by_light.0, narrow(to_light)),
        })
    }

    /// Counts times densities of all techniques that can make the path, in one measure.
    fn densities(&self, path: &Path) -> Option<Techniques> {
        let mut all = [0.0; MOST_SEGMENTS + 2];
        let k = path.count + 1;
        if k == 1 {
            all[0] = 1.0;
            return Some(all);
        }
        let camera = &self.context.scene.camera;
        let size = [self.settings.width, self.settings.height];
        let last = path.vertices[path.count - 1].position;
        let seen = camera.project(size[0], size[1], last, path.lens)?;
        let lens = last - seen.distance * seen.direction;
        let mut at = [At::default(); MOST_SEGMENTS + 1];
        for i in 1..k {
            at[i] = self.at(path, i, lens, i > 1 && at[i - 1].is_caster)?;
        }
        let [emission, light_sample, cos_light] = self.of_light(path)?;
        let pixel = f64::from(seen.pdf) * f64::from(size[0]) * f64::from(size[1]);
        let lens_squared = f64::from(seen.distance) * f64::from(seen.distance);

        // Densities per area of the steps between neighbours that are not delta, by the light walk and by
        // the camera walk. Over a chain of delta vertices light keeps its étendue, which gives their ratio.
        let mut steps = [[1.0; 2]; MOST_SEGMENTS + 1];
        let mut a = 0;
        for b in 1..=k {
            if b < k && at[b].is_delta {
                continue;
            }
            let forward = if a == 0 { emission * cos_light } else { at[a].pdf[0] };
            let back = if b == k { pixel } else { at[b].pdf[1] };
            let cos_a = if a == 0 { cos_light } else { at[a].cos[1] };
            let cos_b = if b == k { 1.0 } else { at[b].cos[0] };
            // The first measure of an environment is that of directions.
            let squared = match a {
                0 if path.light.position.is_none() => 1.0,
                _ if b == k => lens_squared,
                _ => path.towards(a, b).1,
            };
            let squeeze: f64 = (a + 1..b).map(|i| at[i].eta * at[i].eta).product();
            steps[b] = match b == a + 1 {
                true => [forward * cos_b / squared, back * cos_a / squared],
                false => [forward, back * cos_a / (cos_b * squeeze)],
            };
            a = b;
        }
        let is_delta = |i: usize| i > 0 && i < k && at[i].is_delta;
        let by_light = |i: usize| steps[1..=i].iter().map(|step| step[0]).product::<f64>();
        let by_camera = |i: usize| steps[i + 1..=k].iter().map(|step| step[1]).product::<f64>();

        let can_be_hit = self.kind(path.light.index) != LightType::Delta;
        all[0] = if can_be_hit { by_camera(0) } else { 0.0 };
        for i in 0..k {
            // The segment from x_i to x_{i+1} is connected.
            let counts = &self.counts;
            all[i + 1] = match i {
                _ if is_delta(i) || is_delta(i + 1) => 0.0,
                0 => f64::from(counts.light_samples) * light_sample * by_camera(1),
                _ if i + 1 == k && k == 2 => 0.0,
                _ if i + 1 == k => f64::from(counts.light_paths) * by_light(i),
                _ => f64::from(counts.connections) * by_light(i) * by_camera(i + 1),
            };
        }
        let first_rough = (1..k).rev().find(|&i| !at[i].is_caster);
        if let Some(i) = first_rough
            && at[i].arrival.is_some_and(|arrival| arrival.is_merged((k - i) as u32))
        {
            all[MERGE] = at[i].merges * by_light(i) * by_camera(i);
        }
        // A light walk ends where a shading normal depends on it.
        if let Some(i) = (1..k).find(|&i| at[i].is_bent) {
            all[i + 1..].fill(0.0);
        }
        Some(all)
    }

    /// Unit normal of a triangle.
    fn normal_of(&self, triangle: u32) -> Option<Vec3> {
        let [a, b, c] = self.context.scene.mesh.corners(triangle);
        (b - a).cross(c - a).try_normalize()
    }

    /// Density of emission per étendue, that of a light sample, per area of the light where it has one, and
    /// the cosine at the light, 1 where it has none.
    fn of_light(&self, path: &Path) -> Option<[f64; 3]> {
        let Self { context, emission, .. } = self;
        let (scene, lights) = (context.scene, &context.lights);
        let Light { index, position, .. } = path.light;
        let (first, to_light, squared) = {
            let (to_light, squared) = path.towards(1, 0);
            (&path.vertices[0], to_light, squared)
        };
        let to_camera = match path.count {
            1 => {
                let [width, height] = [self.settings.width, self.settings.height];
                -scene.camera.project(width, height, first.position, path.lens)?.direction
            }
            _ => narrow(path.towards(1, 2).0),
        };
        let (point, bsdf) = self.seen_along(first, -to_camera)?;
        let (normal, from, way) =
            (Scatterer { point: &point, bsdf: &bsdf }.normal_for_lights(), first.position, narrow(to_light));
        let [emission, light_sample, cos] = match self.kind(index) {
            LightType::Area => {
                let (light, triangle) = (position?, lights.triangle_of(index)?);
                let cos = dot(to_light, wide(self.normal_of(triangle)?)).abs();
                let distance = libm::sqrt(squared) as f32;
                let density = emission.density_of_emitter(scene, lights, index as usize, (light, -way));
                let pdf = lights.pdf_hit(scene, from, normal, triangle, distance, way);
                [f64::from(density), f64::from(pdf) * cos / squared, cos]
            }
            LightType::Infinite => {
                let density = emission.density_of_environment(scene, lights, way, from);
                [f64::from(density), f64::from(lights.pdf_escape(scene, from, normal, way)), 1.0]
            }
            LightType::Delta => {
                let density = emission.density_of_delta(scene, lights, index, from);
                [f64::from(density), f64::from(lights.probability(index, from, normal)), 1.0]
            }
        };
        Some([emission, light_sample, cos])
    }
}
