//! Points with a normal at which irradiance is estimated, on surfaces or free.

use crate::Rgb;
use crate::bsdf::{All, Bsdf, Diffuse, Features};
use crate::geometry::{Frame, Hit, MISS, Ray};
use crate::scene::{Attributes, Material, Scene, SurfacePoint};
use crate::transport::walk::context::SceneContext;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The surface that stands for a point: π times its reflected radiance is the irradiance.
pub(super) const WHITE: Bsdf = Bsdf::Diffuse(Diffuse { reflectance: Rgb::ONE });
static WHITE_MATERIAL: Material = Material::diffuse(Rgb::ONE);

/// Distance within which a free point lies on a surface, in error bounds of both: the point was computed with
/// rounding as well.
const LIES_ON: f32 = 4.0;

/// Bound of the rounding of a coordinate that a few operations have computed, relative to the coordinate.
const POINT_ROUNDING: f32 = 16.0 * f32::EPSILON;

/// Longest way off a border in margins: needles are thinner than their margins.
const MOST_STEP: f32 = 16.0;

/// Light of which the irradiance is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightPart {
    /// All light.
    #[default]
    All,
    /// Light directly from emitters.
    Direct,
    /// Light that surfaces have scattered.
    Indirect,
}

/// A point with a normal, at which irradiance is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct IrradiancePoint {
    /// Position in the scene.
    pub position: [f32; 3],
    /// Unit normal of the hemisphere.
    pub normal: [f32; 3],
    /// Unit normal of the surface; no light comes from below it.
    pub geometric_normal: [f32; 3],
    /// Triangle of the surface, or [`MISS`] where the point is free.
    pub triangle: u32,
    /// Bound of the distance to the surface, by which rays start above it.
    pub error: f32,
    /// Number of the random numbers of the point. Points of different numbers are independent.
    pub number: u32,
}

impl IrradiancePoint {
    /// A point in space. Its rays leave the very position; [`IrradiancePoint::settled`] puts it on a surface
    /// that it lies on within rounding.
    pub fn free(position: Vec3, normal: Vec3) -> Self {
        let normal = normal.to_array();
        Self {
            position: position.to_array(),
            normal,
            geometric_normal: normal,
            triangle: MISS,
            ..Self::default()
        }
    }

    /// The point of a triangle at the weights `u` and `v` of its second and third corner, on its front, where
    /// the corners go counter-clockwise, or on its back. `None` without such a triangle or its area.
    pub fn on_triangle(scene: &Scene, triangle: u32, [u, v]: [f32; 2], front: bool) -> Option<Self> {
        let [a, b, c] = scene.mesh.corners(triangle);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let direction = if front { -normal } else { normal };
        let hit = Hit { triangle, u, v, t: 0.0 };
        let point = SurfacePoint::at::<All>(scene, &Ray::new(Vec3::ZERO, direction), &hit)?;
        Some(Self::of_surface(&point))
    }

    /// The point of a surface.
    fn of_surface(point: &SurfacePoint) -> Self {
        Self {
            position: point.position.to_array(),
            normal: point.frame.normal.to_array(),
            geometric_normal: point.geometric_normal.to_array(),
            triangle: point.triangle,
            error: point.error,
            number: 0,
        }
    }

    /// The same with the random numbers of `number`.
    #[doc(hidden)]
    pub fn numbered(self, number: u32) -> Self {
        Self { number, ..self }
    }

    /// A free point that lies on a surface within rounding is put on it, on the side of its normal: sensors
    /// at height 0 of a floor are above the floor. A point of a surface at the foot of a wall is put in front
    /// of the wall by its rounding. Other points stay.
    #[doc(hidden)]
    pub fn settled<F: Features>(self, context: &SceneContext<F>) -> Self {
        let point = if self.triangle == MISS { self.on_surface(context) } else { self };
        if point.triangle == MISS { point } else { point.off_walls(context) }
    }

    /// A point of a triangle whose border is the foot of a wall, in front of it: rays of the very border
    /// begin in the plane of the wall and pass it by.
    fn off_walls<F: Features>(self, context: &SceneContext<F>) -> Self {
        let corners = context.scene.mesh.corners(self.triangle);
        let (position, middle) = (Vec3::from(self.position), corners.iter().sum::<Vec3>() / 3.0);
        let margin = LIES_ON * (self.error + POINT_ROUNDING * position.abs().max_element());
        // Part of the distance to the middle, which is as far from each edge as a third of its height; the
        // directions along the edge and from it.
        let edges = [0, 1, 2].map(|i| {
            let (a, along) = (corners[i], corners[(i + 1) % 3] - corners[i]);
            let height = (corners[(i + 2) % 3] - a).reject_from(along);
            let (full, inward) = (height.length(), height.normalize_or_zero());
            let distance = (position - a).dot(inward);
            let missing = (margin - distance).max(0.0);
            let part = missing / (full / 3.0 - distance).max(missing).max(f32::MIN_POSITIVE);
            (part, along.normalize_or_zero(), inward)
        });
        let part = edges.iter().fold(0f32, |most, (part, ..)| most.max(*part));
        let step = (part * (middle - position)).clamp_length_max(MOST_STEP * margin);
        let Some(direction) = step.try_normalize() else { return self };
        let (inside, length) = (position + step, step.length());
        // Across the border, above the surface.
        let above = self.error * Vec3::from(self.geometric_normal);
        let meets = |from: Vec3, direction: Vec3| {
            context.nearest(&Ray::segment(from + above, direction, 2.0 * length)).is_some()
        };
        // A wall may end at the point: rays on both sides of it as well.
        let beside = |(part, along, inward): &(f32, Vec3, Vec3)| {
            let from = position + length * *inward;
            *part > 0.0 && [-length, length].into_iter().any(|side| meets(from + side * *along, -*inward))
        };
        let has_wall = meets(inside, -direction) || edges.iter().any(beside);
        if has_wall { Self { position: inside.to_array(), ..self } } else { self }
    }

    /// The point on a surface that it lies on within rounding, or as it is.
    fn on_surface<F: Features>(self, context: &SceneContext<F>) -> Self {
        let (position, normal) = (Vec3::from(self.position), Vec3::from(self.normal));
        let rounding = POINT_ROUNDING * position.abs().max_element();
        // From above to below, since rays along the surface would not meet it.
        let above = 0.5 * LIES_ON * LIES_ON * rounding;
        let mut ray = Ray::segment(position + above * normal, -normal, 2.0 * above);
        for _ in 0..MOST_COINCIDENT {
            let hit = context.nearest(&ray);
            if !hit.is_some() {
                return self;
            }
            let Some(surface) = context.surface_at(&ray, &hit) else { return self };
            if surface.position.distance(position) <= LIES_ON * (surface.error + rounding) {
                let normal = normal.to_array();
                return Self { normal, number: self.number, ..Self::of_surface(&surface) };
            }
            let below = hit.t * (1.0 + f32::EPSILON) + surface.error;
            ray = Ray::segment(ray.at(below), -normal, (ray.t_max - below).max(0.0));
        }
        self
    }

    /// The white surface at the point.
    #[doc(hidden)]
    pub fn surface<'a>(&self) -> SurfacePoint<'a> {
        SurfacePoint {
            position: self.position.into(),
            error: self.error,
            geometric_normal: self.geometric_normal.into(),
            frame: Frame::from_normal(self.normal.into()),
            attributes: Attributes::NONE,
            front: true,
            material: &WHITE_MATERIAL,
            triangle: self.triangle,
        }
    }
}

/// Most surfaces within rounding of a point that are tried.
const MOST_COINCIDENT: usize = 4;
