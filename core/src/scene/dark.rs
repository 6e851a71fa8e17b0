//! Scenes without light, whose pictures are black.

use super::{Environment, PointLight, Scene, TextureId};
use crate::Rgb;
use glam::{Vec3, Vec4};

impl Scene<'_> {
    /// True if nothing emits: lights, surfaces and environment are black or absent.
    pub fn is_dark(&self) -> bool {
        let emits = |light: &PointLight| match light {
            PointLight::Point { intensity, .. } => is_bright(*intensity),
            PointLight::Spot { intensity, cos_outer, .. } => is_bright(*intensity) && *cos_outer < 1.0,
            PointLight::Directional { irradiance, .. } => is_bright(*irradiance),
        };
        let has_disc = |sky: &Environment| sky.disc.is_some_and(|disc| is_bright(disc.radiance));
        let environment = self.environment.filter(|sky| has_disc(sky) || self.shines(sky.radiance, sky.map));
        environment.is_none() && !self.lights.iter().any(emits) && !self.has_emitter()
    }

    /// True if a triangle with an area has an emissive material.
    fn has_emitter(&self) -> bool {
        let shines = |material: usize| {
            let emission = self.materials.get(material).map(|material| material.emission);
            emission.is_some_and(|emission| self.shines(emission.value, emission.texture))
        };
        let has_area = |index: u32| {
            let [a, b, c] = self.mesh.corners(index);
            (b - a).cross(c - a) != Vec3::ZERO
        };
        // Triangles of one material are usually neighbours.
        let mut last = (usize::MAX, false);
        (0..).zip(self.mesh.triangles).any(|(index, triangle)| {
            let material = triangle.material as usize;
            if last.0 != material {
                last = (material, shines(material));
            }
            last.1 && has_area(index)
        })
    }

    /// True if `value` times some texel of the texture is above zero.
    fn shines(&self, value: Rgb, texture: Option<TextureId>) -> bool {
        let texture = texture.and_then(|texture| self.textures.get(texture.0 as usize));
        let Some(texture) = texture.filter(|_| is_bright(value)) else { return is_bright(value) };
        let (width, height) = (texture.width as usize, texture.height as usize);
        let texel = |x, y| Vec4::from(texture.texel_at(x, y)).truncate();
        (0..height).any(|y| (0..width).any(|x| is_bright(value * texel(x, y))))
    }
}

fn is_bright(light: Rgb) -> bool {
    light.max_element() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        Camera, CameraKind, ColorInput, Instances, Material, Mesh, Surface, Texels, Texture,
        TextureTransform, Triangle, Wrap,
    };
    use glam::Mat3;

    const PLAIN: Scene = Scene {
        mesh: Mesh {
            positions: &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            normals: &[],
            texcoords: &[],
            second_texcoords: &[],
            colors: &[],
            triangles: &[Triangle { vertices: [0, 1, 2], material: 0 }],
            overlaps: &[],
            instances: Instances::NONE,
        },
        materials: &[],
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera {
            kind: CameraKind::Perspective,
            eye: Vec3::ZERO,
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::Z,
            tan_half_fov: 1.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
            start: None,
        },
    };

    fn emissive(value: Rgb, texture: Option<TextureId>) -> Material {
        Material {
            surface: Surface::Diffuse { reflectance: Rgb::ONE.into() },
            emission: ColorInput { texture, ..value.into() },
            two_sided: false,
            opacity: 1.0.into(),
            normal_map: None,
        }
    }

    fn texture(texels: &[[f32; 3]]) -> Texture<'_> {
        let (width, height) = (texels.len() as u32, 1);
        let transform = TextureTransform::IDENTITY;
        Texture {
            width,
            height,
            texels: Texels::Float(texels),
            wrap: Wrap::REPEAT,
            transform,
            second_set: false,
        }
    }

    #[test]
    fn lights_emit_unless_they_are_black() {
        assert!(PLAIN.is_dark());
        let (position, direction) = (Vec3::ZERO, Vec3::Z);
        for (light, is_dark) in [(0.0, true), (1e-30, false)] {
            let intensity = Rgb::new(0.0, light, 0.0);
            let spot =
                |cos_outer| PointLight::Spot { position, direction, intensity, cos_inner: 1.0, cos_outer };
            for kind in [
                PointLight::Point { position, intensity },
                PointLight::Directional { direction, irradiance: intensity },
                spot(0.9),
            ] {
                assert_eq!(Scene { lights: &[kind], ..PLAIN }.is_dark(), is_dark, "{kind:?}");
            }
            assert!(Scene { lights: &[spot(1.0)], ..PLAIN }.is_dark());
        }
    }

    #[test]
    fn maps_and_their_factors_emit_together() {
        let texels = [[0.0; 3], [0.0, 2.0, 0.0]];
        let textures = [texture(&texels[..1]), texture(&texels)];
        let [black, green] = [0, 1].map(|number| Some(TextureId(number)));
        for (value, map, is_dark) in [
            (Rgb::ONE, None, false),
            (Rgb::ZERO, None, true),
            (Rgb::ONE, black, true),
            (Rgb::ONE, green, false),
            (Rgb::X, green, true),
            (Rgb::ZERO, green, true),
        ] {
            let sky = Some(Environment { radiance: value, map, to_map: Mat3::IDENTITY, disc: None });
            assert_eq!(Scene { environment: sky, textures: &textures, ..PLAIN }.is_dark(), is_dark);
            let materials = [emissive(value, map)];
            let scene = Scene { materials: &materials, textures: &textures, ..PLAIN };
            assert_eq!(scene.is_dark(), is_dark);
            let flat = Mesh { positions: &[[0.0; 3]; 3], ..PLAIN.mesh };
            assert!(Scene { mesh: flat, ..scene }.is_dark(), "it has no area");
        }
    }
}
