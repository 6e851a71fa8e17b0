//! Scenes that hold lamps alone, for tests of lights.

use glam::{DVec3, Vec3};
use halflight_core::Rgb;
use halflight_core::bvh::brute::intersect;
use halflight_core::geometry::Ray;
use halflight_core::light::LightSampler;
use halflight_core::sampling::{Random, warp};
use halflight_core::scene::{Camera, Material, Mesh, Scene, Texture, Triangle};
use halflight_core::scene::{Environment, PointLight};
use halflight_tests::memory::TestArena;

/// A flat light.
#[derive(Clone)]
pub(crate) struct Lamp {
    /// Outline, counter-clockwise seen from the emitting side.
    pub(crate) corners: Vec<Vec3>,
    pub(crate) radiance: f32,
    pub(crate) two_sided: bool,
}

impl Lamp {
    pub(crate) fn triangle(corners: [Vec3; 3]) -> Self {
        Self { corners: corners.to_vec(), radiance: 1.0, two_sided: false }
    }

    pub(crate) fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Self {
        Self {
            corners: vec![corner, corner + u, corner + u + v, corner + v],
            radiance: 1.0,
            two_sided: false,
        }
    }

    pub(crate) fn outline(&self) -> Vec<DVec3> {
        self.corners.iter().map(|c| c.as_dvec3()).collect()
    }

    /// Small and large lamps of every shape within the unit sphere, some two-sided.
    pub(crate) fn cloud(count: u32, seed: u32) -> Vec<Lamp> {
        (0..count)
            .map(|i| {
                let random = Random::new(seed, i);
                let center = 0.8 * random_direction(&random, 0);
                let (u, v) = (random_direction(&random, 2), random_direction(&random, 4));
                let size = 0.05 + 0.8 * random.single(6) * random.single(7);
                let v = if i % 3 == 1 { v } else { u.cross(v).normalize() * (0.5 + random.single(8)) };
                let lamp = if i % 3 == 0 {
                    Lamp::triangle([center, center + u * size, center + v * size])
                } else {
                    Lamp::quad(center, u * size, v * size)
                };
                Lamp { radiance: 0.2 + 5.0 * random.single(9), two_sided: i % 4 == 0, ..lamp }
            })
            .collect()
    }
}

pub(crate) fn random_direction(random: &Random, counter: u32) -> Vec3 {
    warp::uniform_sphere([random.single(counter), random.single(counter + 1)])
}

/// The buffers of a scene.
#[derive(Default)]
pub(crate) struct Stage {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) texcoords: Vec<[f32; 2]>,
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) materials: Vec<Material>,
    pub(crate) lights: Vec<PointLight>,
    pub(crate) environment: Option<Environment>,
    pub(crate) textures: Vec<Texture<'static>>,
}

impl Stage {
    pub(crate) fn of(lamps: &[Lamp]) -> Self {
        let mut stage = Stage::default();
        for lamp in lamps {
            stage.add(lamp);
        }
        stage
    }

    pub(crate) fn add(&mut self, lamp: &Lamp) {
        let first = self.positions.len() as u32;
        let material = self.materials.len() as u32;
        self.positions.extend(lamp.corners.iter().map(|c| c.to_array()));
        for i in 2..lamp.corners.len() as u32 {
            self.triangles.push(Triangle { vertices: [first, first + i - 1, first + i], material });
        }
        let mut dark = Material::GREY;
        dark.emission.value = Rgb::splat(lamp.radiance);
        dark.two_sided = lamp.two_sided;
        self.materials.push(dark);
    }

    pub(crate) fn scene(&self) -> Scene<'_> {
        Scene {
            mesh: Mesh {
                positions: &self.positions,
                texcoords: &self.texcoords,
                triangles: &self.triangles,
                ..Mesh::default()
            },
            materials: &self.materials,
            textures: &self.textures,
            lights: &self.lights,
            environment: self.environment,
            camera: Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40.0),
        }
    }

    /// Calls `use_them` with lights built in an arena of exactly the footprint.
    pub(crate) fn with_lights<T>(&self, use_them: impl FnOnce(&Scene, &LightSampler) -> T) -> T {
        let scene = self.scene();
        let footprint = LightSampler::footprint(&scene).and(LightSampler::scratch(&scene));
        let mut memory = TestArena::new(footprint);
        let mut arena = memory.arena();
        let lights = LightSampler::build(&scene, &mut arena).expect("the footprint is what the build takes");
        assert_eq!(arena.available(), LightSampler::scratch(&scene).bytes(), "what is kept is the footprint");
        use_them(&scene, &lights)
    }

    /// Every triangle that the ray hits, in mesh order.
    pub(crate) fn all_hits(&self, origin: Vec3, direction: Vec3) -> impl Iterator<Item = (u32, f32)> + '_ {
        let mesh = Mesh { positions: &self.positions, triangles: &self.triangles, ..Mesh::default() };
        let ray = Ray::new(origin, direction);
        (0..self.triangles.len() as u32).filter_map(move |i| {
            let corners = mesh.corners(i).map(|p| p.to_array());
            intersect(&ray, corners).map(|(t, _, _)| (i, t))
        })
    }

    /// The triangle hit at about `distance`, with the exact distance.
    pub(crate) fn hit_near(&self, origin: Vec3, direction: Vec3, distance: f32) -> Option<(u32, f32)> {
        self.all_hits(origin, direction).find(|(_, t)| (t / distance - 1.0).abs() < 1e-4)
    }
}
