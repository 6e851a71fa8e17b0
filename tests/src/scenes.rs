//! Small scenes made by hand, whose radiance is known or can be reasoned about.

use glam::{Mat3, Vec3};
use halflight_core::Rgb;
use halflight_core::scene::{
    Camera, ColorInput, Environment, Material, Mesh, PointLight, Scene, Surface, Texture, Triangle,
};

/// Buffers of a scene with a camera.
#[derive(Clone, Debug)]
pub struct SceneBuffers {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Normals; empty, or one for each position.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates; empty, or one for each position.
    pub texcoords: Vec<[f32; 2]>,
    /// Triangles.
    pub triangles: Vec<Triangle>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Delta lights.
    pub lights: Vec<PointLight>,
    /// Environment.
    pub environment: Option<Environment>,
    /// Camera.
    pub camera: Camera,
}

impl SceneBuffers {
    /// A scene without geometry and lights.
    pub fn new(camera: Camera) -> Self {
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            texcoords: Vec::new(),
            triangles: Vec::new(),
            materials: Vec::new(),
            lights: Vec::new(),
            environment: None,
            camera,
        }
    }

    /// The scene without textures.
    pub fn scene(&self) -> Scene<'_> {
        self.textured(&[])
    }

    /// The scene with `textures`.
    pub fn textured<'a>(&'a self, textures: &'a [Texture<'a>]) -> Scene<'a> {
        Scene {
            mesh: Mesh {
                positions: &self.positions,
                normals: &self.normals,
                texcoords: &self.texcoords,
                triangles: &self.triangles,
                ..Mesh::default()
            },
            materials: &self.materials,
            textures,
            lights: &self.lights,
            environment: self.environment,
            camera: self.camera,
        }
    }

    /// Adds a material and returns its number.
    pub fn material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// Adds a quadrilateral, counter-clockwise seen from its front.
    pub fn quad(&mut self, corners: [Vec3; 4], material: u32) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners.map(|p| p.to_array()));
        let mut face = |corners: [u32; 3]| {
            self.triangles.push(Triangle { vertices: corners.map(|i| first + i), material });
        };
        face([0, 1, 2]);
        face([0, 2, 3]);
    }

    /// Adds a square of side `size` around `center` that faces `normal`.
    pub fn square(&mut self, center: Vec3, normal: Vec3, size: f32, material: u32) {
        let (u, v) = normal.any_orthonormal_pair();
        let (u, v) = if u.cross(v).dot(normal) > 0.0 { (u, v) } else { (v, u) };
        let corner = |a: f32, b: f32| center + 0.5 * size * (a * u + b * v);
        self.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], material);
    }

    /// Adds a closed box from `min` to `max` whose faces look outwards, or inwards.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, inwards: bool, material: u32) {
        let at = |i: usize| {
            Vec3::new(
                if i & 1 == 0 { min.x } else { max.x },
                if i & 2 == 0 { min.y } else { max.y },
                if i & 4 == 0 { min.z } else { max.z },
            )
        };
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        for mut face in faces {
            if inwards {
                face.reverse();
            }
            self.quad(face.map(at), material);
        }
    }

    /// Adds a sphere of about `2 * rings²` quadrilaterals, with smooth normals if the scene has normals.
    pub fn sphere(&mut self, center: Vec3, radius: f32, rings: u32, material: u32) {
        let first = self.positions.len() as u32;
        let segments = 2 * rings;
        for ring in 0..=rings {
            let theta = core::f32::consts::PI * ring as f32 / rings as f32;
            for segment in 0..=segments {
                let phi = core::f32::consts::TAU * (segment % segments) as f32 / segments as f32;
                let normal =
                    Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()).normalize();
                self.positions.push((center + radius * normal).to_array());
                self.normals.push(normal.to_array());
            }
        }
        let mut face = |vertices: [u32; 3]| self.triangles.push(Triangle { vertices, material });
        for ring in 0..rings {
            for segment in 0..segments {
                let a = first + ring * (segments + 1) + segment;
                let (b, c, d) = (a + 1, a + segments + 2, a + segments + 1);
                if ring > 0 {
                    face([a, b, c]);
                }
                if ring + 1 < rings {
                    face([a, c, d]);
                }
            }
        }
    }
}

/// A diffuse surface that emits.
pub fn emitter(reflectance: f32, radiance: f32) -> Material {
    Material {
        emission: ColorInput::from(Rgb::splat(radiance)),
        ..Material::diffuse(Rgb::splat(reflectance))
    }
}

/// An environment of constant radiance.
pub fn constant_environment(radiance: f32) -> Option<Environment> {
    Some(Environment { radiance: Rgb::splat(radiance), map: None, to_map: Mat3::IDENTITY, disc: None })
}

/// The Cornell box by its published measurements, in units of 555.2 mm: walls, two blocks, a lamp.
pub fn cornell_box() -> SceneBuffers {
    const UNIT: f32 = 1.0 / 555.2;
    let eye = Vec3::new(278.0, 273.0, -800.0) * UNIT;
    let mut scene = SceneBuffers::new(Camera::look_at(eye, eye + Vec3::Z, Vec3::Y, 39.3));
    let white = scene.material(Material::diffuse(Rgb::new(0.73, 0.735, 0.729)));
    let red = scene.material(Material::diffuse(Rgb::new(0.611, 0.0555, 0.062)));
    let green = scene.material(Material::diffuse(Rgb::new(0.117, 0.4125, 0.115)));
    let lamp = scene.material(Material {
        emission: ColorInput::from(Rgb::new(18.387, 13.9873, 6.75357)),
        ..Material::diffuse(Rgb::splat(0.78))
    });
    let mut quad = |corners: [[f32; 3]; 4], material: u32| {
        scene.quad(corners.map(|p| Vec3::from(p) * UNIT), material);
    };
    quad([[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]], white);
    quad([[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]], white);
    quad([[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]], white);
    quad([[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]], green);
    quad([[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]], red);
    quad([[343.0, 548.7, 227.0], [343.0, 548.7, 332.0], [213.0, 548.7, 332.0], [213.0, 548.7, 227.0]], lamp);
    let short = [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]];
    let tall = [[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]];
    for (base, top) in [(short, 165.0), (tall, 330.0)] {
        quad(base.map(|[x, z]| [x, top, z]), white);
        for i in 0..4 {
            let ([ax, az], [bx, bz]) = (base[i], base[(i + 1) % 4]);
            quad([[ax, 0.0, az], [bx, 0.0, bz], [bx, top, bz], [ax, top, az]].map(|p| p), white);
        }
    }
    scene
}

/// The Cornell box with a floor of metal, alpha 0.3, and a tall block of plastic, alpha 0.4, seen from above:
/// records do not serve the lobes of grazing viewers.
pub fn rough_box() -> SceneBuffers {
    box_from_above(metal(0.3f32.sqrt()), varnish(0.4f32.sqrt()))
}

/// The Cornell box with a floor of `floor` and a tall block of `block`, seen from above.
pub fn box_from_above(floor: Surface, block: Surface) -> SceneBuffers {
    let mut buffers = cornell_box();
    let (eye, target) = (Vec3::new(0.5, 0.9, 0.03), Vec3::new(0.5, 0.1, 0.6));
    buffers.camera = Camera::look_at(eye, target, Vec3::Y, 75.0);
    let [floor, block] =
        [floor, block].map(|surface| buffers.material(Material { surface, ..Material::GREY }));
    let first = buffers.triangles.len() - 10;
    buffers.triangles[..2].iter_mut().for_each(|triangle| triangle.material = floor);
    buffers.triangles[first..].iter_mut().for_each(|triangle| triangle.material = block);
    buffers
}

/// Centres of the legs of [`table_in_the_sun`] on its floor, along x and z.
pub const TABLE_LEGS: [[f32; 2]; 4] = [[0.3, 0.4], [0.7, 0.4], [0.3, 0.75], [0.7, 0.75]];
/// Width of a leg.
pub const TABLE_LEG: f32 = 0.04;
/// Height of the floor.
pub const TABLE_FLOOR: f32 = 0.001;

/// A dim room with a floor of `floor`, on which the thin legs of a table stand in the sun of a spot light.
pub fn table_in_the_sun(floor: Surface) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.5, 0.7, 0.02), Vec3::new(0.5, 0.0, 0.55), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.5)));
    let floor = buffers.material(Material { surface: floor, ..Material::GREY });
    let wood = buffers.material(Material::diffuse(Rgb::new(0.7, 0.5, 0.3)));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    buffers.quad(corners.map(|[x, z]| Vec3::new(x, TABLE_FLOOR, z)), floor);
    for [x, z] in TABLE_LEGS {
        let low = Vec3::new(x - 0.5 * TABLE_LEG, TABLE_FLOOR, z - 0.5 * TABLE_LEG);
        buffers.cuboid(low, low + Vec3::new(TABLE_LEG, 0.25, TABLE_LEG), false, wood);
    }
    buffers.cuboid(Vec3::new(0.26, 0.251, 0.36), Vec3::new(0.74, 0.27, 0.79), false, wood);
    let position = Vec3::new(0.3, 0.35, 0.02);
    let direction = (Vec3::new(0.3, 0.12, 0.38) - position).normalize();
    let (cos_inner, cos_outer) = (0.98, 0.95);
    buffers.lights.push(PointLight::Spot {
        position,
        direction,
        intensity: Rgb::splat(1.0),
        cos_inner,
        cos_outer,
    });
    let lamp = buffers.material(emitter(0.0, 1.0));
    buffers.square(Vec3::new(0.5, 0.97, 0.5), Vec3::NEG_Y, 0.3, lamp);
    buffers
}

/// A lamp of side `size` in front of an object of `surface`, and a floor lit by both: a caustic if `surface`
/// is specular, large enough for paths to find it.
pub fn lamp_before(surface: Surface, size: f32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.0, 2.5, 3.0), Vec3::new(0.0, 0.0, 0.5), Vec3::Y, 40.0);
    let mut buffers = SceneBuffers::new(camera);
    let floor = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let thing = buffers.material(Material { surface, ..Material::GREY });
    let lamp = buffers.material(emitter(0.0, 5.0));
    buffers.square(Vec3::ZERO, Vec3::Y, 4.0, floor);
    buffers.square(Vec3::new(0.0, 1.0, -1.0), Vec3::Z, 1.0, thing);
    buffers.square(Vec3::new(0.0, 1.0, -0.5), Vec3::NEG_Z, size, lamp);
    buffers
}

/// A ball of `surface` between a floor and a lamp of side `size`.
pub fn lamp_over_ball(surface: Surface, size: f32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.0, 2.0, 3.5), Vec3::new(0.0, 0.3, 0.0), Vec3::Y, 40.0);
    let mut buffers = SceneBuffers::new(camera);
    let floor = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let ball = buffers.material(Material { surface, ..Material::GREY });
    let lamp = buffers.material(emitter(0.0, 8.0 / (size * size)));
    buffers.square(Vec3::ZERO, Vec3::Y, 4.0, floor);
    buffers.normals = vec![[0.0; 3]; buffers.positions.len()];
    buffers.sphere(Vec3::new(0.0, 0.6, 0.0), 0.5, 24, ball);
    buffers.square(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Y, size, lamp);
    buffers.normals.resize(buffers.positions.len(), [0.0; 3]);
    buffers
}

/// Puts the scene into a room, whose walls the caustic then lights.
pub fn in_a_room(mut buffers: SceneBuffers) -> SceneBuffers {
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.6)));
    buffers.cuboid(Vec3::new(-3.0, -0.5, -3.0), Vec3::new(3.0, 3.5, 4.5), true, wall);
    buffers.normals.resize(buffers.positions.len(), [0.0; 3]);
    buffers
}

/// Metal: a mirror at roughness 0.
pub fn metal(roughness: f32) -> Surface {
    Surface::Conductor { reflectance: Rgb::splat(0.9).into(), roughness: roughness.into() }
}

/// A diffuse surface under a coat of `roughness`.
pub fn varnish(roughness: f32) -> Surface {
    Surface::Glossy {
        base: Rgb::new(0.5, 0.35, 0.2).into(),
        specular: Rgb::splat(0.04).into(),
        roughness: roughness.into(),
        metallic: 0.0.into(),
        ior: Some(1.5),
    }
}

/// The scene with varnish of `roughness` in place of all diffuse surfaces that do not emit.
pub fn varnished(mut buffers: SceneBuffers, roughness: f32) -> SceneBuffers {
    for material in &mut buffers.materials {
        if matches!(material.surface, Surface::Diffuse { .. }) && !material.emits() {
            material.surface = varnish(roughness);
        }
    }
    buffers
}

/// Glass of index 1.5.
pub fn glass(roughness: f32) -> Surface {
    Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: roughness.into() }
}

/// A bright and a dark room separated by a wall of thickness 0.001, seen from the dark one.
pub fn bright_and_dark() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.52, 0.5, 0.95), Vec3::new(0.52, 0.45, 0.0), Vec3::Y, 80.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.8)));
    let lamp = buffers.material(emitter(0.0, 20.0));
    buffers.cuboid(Vec3::ZERO, Vec3::new(0.5, 1.0, 1.0), true, wall);
    buffers.cuboid(Vec3::new(0.501, 0.0, 0.0), Vec3::ONE, true, wall);
    buffers.square(Vec3::new(0.25, 0.9, 0.5), Vec3::NEG_Y, 0.2, lamp);
    buffers
}

/// Camera position in the bright room, opposite the camera of [`bright_and_dark`].
pub const IN_THE_BRIGHT_ROOM: Vec3 = Vec3::new(0.48, 0.5, 0.95);

/// The Cornell box with a mirror, glass, a coat, a cut-out, smooth normals, a lens, a sky and a point light.
pub fn everything() -> SceneBuffers {
    let mut scene = cornell_box();
    scene.normals = vec![[0.0; 3]; scene.positions.len()];
    let mut add = |surface| scene.material(Material { surface, ..Material::GREY });
    let glass = add(Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: 0.0.into() });
    let frosted = add(Surface::Dielectric { ior: 1.3, tint: Rgb::ONE, roughness: 0.4.into() });
    let mirror = add(Surface::Mirror { reflectance: Rgb::splat(0.9).into() });
    let metal =
        add(Surface::Conductor { reflectance: Rgb::new(0.9, 0.7, 0.4).into(), roughness: 0.5.into() });
    let coat = add(Surface::Glossy {
        base: Rgb::new(0.2, 0.3, 0.7).into(),
        specular: Rgb::splat(0.05).into(),
        roughness: 0.3.into(),
        metallic: 0.0.into(),
        ior: None,
    });
    let veil = scene.material(Material { opacity: 0.4.into(), ..Material::GREY });
    for (i, material) in [glass, frosted, mirror, metal, coat].into_iter().enumerate() {
        scene.sphere(Vec3::new(0.15 + 0.17 * i as f32, 0.45, 0.25), 0.08, 6, material);
    }
    let corners = [[0.2, 0.1], [0.8, 0.1], [0.8, 0.7], [0.2, 0.7]].map(|[x, y]| Vec3::new(x, y, 0.1));
    let before = scene.positions.len();
    scene.quad(corners, veil);
    scene.normals.resize(scene.normals.len() + scene.positions.len() - before, [0.0; 3]);
    scene.camera.lens_radius = 0.02;
    scene.camera.focus_distance = 1.7;
    scene.environment = constant_environment(0.1);
    scene.lights.push(PointLight::Point { position: Vec3::new(0.5, 0.2, -0.3), intensity: Rgb::splat(0.2) });
    scene
}

/// A unit room with a lamp of `opacity` and `radiance` under its ceiling, outside the view.
pub fn room_with_lamp(opacity: f32, radiance: f32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.5, 0.6, 0.05), Vec3::new(0.5, 0.2, 1.0), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.5)));
    let lamp = buffers.material(Material { opacity: opacity.into(), ..emitter(0.0, radiance) });
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    buffers.square(Vec3::new(0.5, 0.97, 0.4), Vec3::NEG_Y, 0.15, lamp);
    buffers
}
