//! Small scenes in f64, as in files, and the mean radiance of their pictures.

use core::sync::atomic::AtomicBool;
use glam::{DVec3, Mat3};
use halflight::load::SceneTransform;
use halflight::render::{Reconstruct, Settings, Stop, render};
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Environment, Material, Mesh, PointLight, Scene, Surface, Triangle};

/// Scene with its camera and the settings of its picture.
#[derive(Clone, Debug)]
pub(super) struct TestScene {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) triangles: Vec<Triangle>,
    pub(super) materials: Vec<Material>,
    pub(super) lights: Vec<PointLight>,
    /// Radiance of the sky; `None` for no sky.
    pub(super) sky: Option<f32>,
    pub(super) eye: DVec3,
    pub(super) look_at: DVec3,
    /// Vertical field of view in degrees.
    pub(super) fov: f64,
    pub(super) size: [u32; 2],
    pub(super) spp: u32,
}

/// Mean radiance of a picture.
pub(super) struct Measured {
    pub(super) mean: f64,
    /// Standard error, from the halves of all pixels.
    pub(super) error: f64,
    /// Rejected samples and pixels that are not finite.
    pub(super) rejected: u64,
}

impl TestScene {
    /// Empty scene, seen from `eye`.
    pub(super) fn new(eye: DVec3, look_at: DVec3, fov: f64) -> Self {
        Self {
            positions: Vec::new(),
            triangles: Vec::new(),
            materials: Vec::new(),
            lights: Vec::new(),
            sky: None,
            eye,
            look_at,
            fov,
            size: [16, 16],
            spp: 64,
        }
    }

    /// Closed box of side 2 around the origin, seen from inside, whose walls reflect and emit.
    pub(super) fn furnace(reflectance: f32, radiance: f32) -> Self {
        let mut scene = Self::new(DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.1, -0.2, -1.0), 70.0);
        let material = scene.material(emitter(reflectance, radiance));
        scene.cuboid(DVec3::NEG_ONE, DVec3::ONE, true, material);
        scene
    }

    pub(super) fn material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    pub(super) fn triangle(&mut self, corners: [DVec3; 3], material: u32) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners.map(|corner| corner.to_array()));
        self.triangles.push(Triangle { vertices: [first, first + 1, first + 2], material });
    }

    /// Quadrilateral, counter-clockwise from its front.
    pub(super) fn quad(&mut self, [a, b, c, d]: [DVec3; 4], material: u32) {
        self.triangle([a, b, c], material);
        self.triangle([a, c, d], material);
    }

    /// Square in a plane of constant y, facing up or down.
    pub(super) fn square(&mut self, center: DVec3, side: f64, up: bool, material: u32) {
        let corner = |x: f64, z: f64| center + 0.5 * side * DVec3::new(x, 0.0, z);
        let mut corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
        if !up {
            corners.reverse();
        }
        self.quad(corners, material);
    }

    /// Closed box with faces that look outwards or inwards.
    pub(super) fn cuboid(&mut self, min: DVec3, max: DVec3, inwards: bool, material: u32) {
        for mut face in faces(min, max) {
            if inwards {
                face.reverse();
            }
            self.quad(face, material);
        }
    }

    /// Scene scaled by `factor`, then moved by `offset`.
    pub(super) fn moved(mut self, factor: f64, offset: DVec3) -> Self {
        let point = |p: DVec3| p * factor + offset;
        for position in &mut self.positions {
            *position = point(DVec3::from(*position)).to_array();
        }
        (self.eye, self.look_at) = (point(self.eye), point(self.look_at));
        self
    }

    /// Mean radiance of the picture, after the transform that the loader applies.
    pub(super) fn measure(&self) -> Result<Measured, String> {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for position in &self.positions {
            for (i, x) in position.iter().enumerate() {
                bounds[0][i] = bounds[0][i].min(*x);
                bounds[1][i] = bounds[1][i].max(*x);
            }
        }
        let transform = SceneTransform::fitting(bounds[0], bounds[1]);
        let positions: Vec<[f32; 3]> = self.positions.iter().map(|p| transform.point(*p).into()).collect();
        let mesh = Mesh { positions: &positions, triangles: &self.triangles, ..Mesh::default() };
        let up = if (self.look_at - self.eye).normalize().y.abs() > 0.9 { DVec3::Z } else { DVec3::Y };
        let sky = |radiance| Environment {
            radiance: Rgb::splat(radiance),
            map: None,
            to_map: Mat3::IDENTITY,
            disc: None,
        };
        let scene = Scene {
            mesh,
            materials: &self.materials,
            textures: &[],
            lights: &self.lights,
            environment: self.sky.map(sky),
            camera: transform.camera(self.eye.into(), self.look_at.into(), up.into(), self.fov),
        };
        let settings = Settings {
            width: self.size[0],
            height: self.size[1],
            stop: Stop { spp: Some(self.spp), ..Stop::default() },
            reuse: Some(false),
            reconstruct: Reconstruct::Off,
            ..Settings::default()
        };
        let picture = render(&scene, &settings, &mut |_| {}, &AtomicBool::new(false));
        let picture = picture.map_err(|error| error.to_string())?;
        let count = picture.image.pixels.len() as f64;
        let sum = |pixels: &[[f32; 3]]| pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>();
        let invalid = picture.image.pixels.iter().flatten().filter(|value| !value.is_finite()).count() as u64;
        Ok(Measured {
            mean: sum(&picture.image.pixels) / count,
            error: sum(&picture.variance.pixels).sqrt() / count,
            rejected: picture.counters.dropped.total() + invalid,
        })
    }
}

/// Faces of a box, looking outwards.
pub(super) fn faces(min: DVec3, max: DVec3) -> [[DVec3; 4]; 6] {
    let at = |i: usize| {
        DVec3::new(
            if i & 1 == 0 { min.x } else { max.x },
            if i & 2 == 0 { min.y } else { max.y },
            if i & 4 == 0 { min.z } else { max.z },
        )
    };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.map(|face| face.map(at))
}

/// Diffuse emitter.
pub(super) fn emitter(reflectance: f32, radiance: f32) -> Material {
    Material {
        emission: ColorInput::from(Rgb::splat(radiance)),
        ..Material::diffuse(Rgb::splat(reflectance))
    }
}

/// Material with a surface and no emission.
pub(super) fn with_surface(surface: Surface) -> Material {
    Material { surface, ..Material::GREY }
}
