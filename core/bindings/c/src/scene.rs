//! Scenes of a C program: triangles, materials, textures, lights and the camera.

use crate::memory::{array, bytes_of, place, shared};
use crate::mesh::HalflightMesh;
use crate::status::{HalflightStatus, of};
use core::ffi::c_void;
use halflight_core::glam::Vec3;
use halflight_core::memory::{Arena, Footprint};
use halflight_core::scene::{
    Camera, ColorInput, Environment, Material, PointLight, ScalarInput, Scene, Surface, Texels, Texture,
    TextureId, TextureTransform, Wrap,
};

/// Diffuse surface: `color` is its reflectance.
pub const HALFLIGHT_DIFFUSE: u32 = 0;
/// Perfect mirror: `color` is its reflectance.
pub const HALFLIGHT_MIRROR: u32 = 1;
/// Metal: `color` is its reflectance at normal incidence, `roughness` the square root of the alpha of GGX.
pub const HALFLIGHT_METAL: u32 = 2;
/// Coat over a diffuse base of `color`: `specular` at normal incidence, `roughness`, `metallic` 0 to 1.
pub const HALFLIGHT_COATED: u32 = 3;
/// Glass or water inside of the surface: `ior`, `roughness`, `color` a factor on transmitted light.
pub const HALFLIGHT_GLASS: u32 = 4;
/// Thin pane: `ior`, `color` the transmittance of its body.
pub const HALFLIGHT_PANE: u32 = 5;

/// A surface. Zeros are an opaque, black, diffuse surface without light.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightMaterial {
    /// `HALFLIGHT_DIFFUSE` and others.
    pub surface: u32,
    /// Colour; its meaning depends on the surface.
    pub color: [f32; 3],
    /// Texture that multiplies `color`: 1 + its index in the scene; 0: none.
    pub color_texture: u32,
    /// Reflectance of a coat at normal incidence.
    pub specular: [f32; 3],
    /// Square root of the alpha of GGX, 0 to 1; 0 is smooth.
    pub roughness: f32,
    /// 0: coat over a base, 1: metal.
    pub metallic: f32,
    /// Index of refraction; 0: 1.5.
    pub ior: f32,
    /// Emitted radiance, W/(m² sr).
    pub emission: [f32; 3],
    /// Texture that multiplies `emission`: 1 + its index; 0: none.
    pub emission_texture: u32,
    /// True if the back emits as well.
    pub emits_on_both_sides: bool,
    /// Probability that a ray passes as if there were no surface, 0 to 1.
    pub transparency: f32,
}

/// Texels row by row from the top. They stay where they are: the program keeps them as long as the scene.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightTexture {
    /// `width * height` texels of 4 bytes: sRGB and alpha; or null.
    pub srgb: *const u8,
    /// `width * height` texels of 3 floats, linear; or null.
    pub linear: *const f32,
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// True if the border extends beyond the edge; otherwise the texture repeats.
    pub clamps: bool,
}

/// Light of equal intensity in all directions.
pub const HALFLIGHT_POINT_LIGHT: u32 = 0;
/// Light in a cone.
pub const HALFLIGHT_SPOT_LIGHT: u32 = 1;
/// Parallel light from infinity.
pub const HALFLIGHT_DIRECTIONAL_LIGHT: u32 = 2;

/// A light without a surface.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightLight {
    /// `HALFLIGHT_POINT_LIGHT` and others.
    pub kind: u32,
    /// Position of a point or spot light.
    pub position: [f32; 3],
    /// Direction in which a spot or directional light travels, of any length.
    pub direction: [f32; 3],
    /// Radiant intensity, W/sr; of directional lights irradiance on a surface that faces it, W/m².
    pub power: [f32; 3],
    /// Angle from the axis of a spot light up to which its intensity is full.
    pub inner_degrees: f32,
    /// Angle from the axis of a spot light from which there is no light.
    pub outer_degrees: f32,
}

/// Perspective camera.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightCamera {
    /// Position.
    pub eye: [f32; 3],
    /// Point in the centre of the picture.
    pub target: [f32; 3],
    /// Direction that is up in the picture.
    pub up: [f32; 3],
    /// Vertical field of view, above 0 and at most 178; 0 without a picture.
    pub vertical_fov_degrees: f32,
    /// Radius of the lens; 0: a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane of focus; unused by a pinhole.
    pub focus_distance: f32,
}

/// A scene to be made. It may be freed afterwards, but for texels.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightSceneDescription {
    /// Triangles.
    pub mesh: HalflightMesh,
    /// Materials.
    pub materials: *const HalflightMaterial,
    /// Their number.
    pub material_count: usize,
    /// Textures, or null.
    pub textures: *const HalflightTexture,
    /// Their number.
    pub texture_count: usize,
    /// Lights without surface, or null.
    pub lights: *const HalflightLight,
    /// Their number.
    pub light_count: usize,
    /// Radiance from infinity, or a factor on `environment_texture`; black: none.
    pub environment: [f32; 3],
    /// Latitude-longitude map of the environment, row 0 up (+Y): 1 + its index; 0: none.
    pub environment_texture: u32,
    /// Camera.
    pub camera: HalflightCamera,
}

/// A scene.
pub struct HalflightScene {
    pub(crate) scene: Scene<'static>,
}

/// Bytes of a scene, of which only the numbers of things matter; 0 of null.
///
/// # Safety
/// `description` is null or a description.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_scene_memory(description: *const HalflightSceneDescription) -> usize {
    // SAFETY: by the caller.
    let Ok(description) = (unsafe { shared(description) }) else { return 0 };
    let structures = description.mesh.footprint().and(slots::<Material>(description.material_count));
    let structures = structures.and(slots::<Texture>(description.texture_count));
    bytes_of::<HalflightScene>(structures.and(slots::<PointLight>(description.light_count)))
}

/// Makes a scene in `bytes` bytes at `memory`.
///
/// # Safety
/// Pointers are null or of arrays as large as they say; `memory` belongs to the scene from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_scene_new(
    description: *const HalflightSceneDescription,
    memory: *mut c_void,
    bytes: usize,
    scene: *mut *mut HalflightScene,
) -> HalflightStatus {
    let make = |arena: &mut Arena<'static>| {
        // SAFETY: by the caller.
        let description = unsafe { shared(description) }?;
        // SAFETY: by the caller.
        Ok(HalflightScene { scene: unsafe { description.scene(arena) }? })
    };
    // SAFETY: by the caller.
    of(unsafe { place((memory, bytes), scene, make) })
}

impl HalflightSceneDescription {
    /// The scene in memory of `arena`.
    ///
    /// # Safety
    /// Its pointers are null or of arrays as large as they say.
    unsafe fn scene(&self, arena: &mut Arena<'static>) -> Result<Scene<'static>, HalflightStatus> {
        // SAFETY: by the caller.
        let mesh = unsafe { self.mesh.copied(arena) }?;
        mesh.validate(self.material_count).map_err(|_| HalflightStatus::Triangle)?;
        // SAFETY: by the caller, in this and the next two lines.
        let materials = unsafe { array(self.materials, self.material_count) }?;
        let textures = unsafe { array(self.textures, self.texture_count) }?;
        let lights = unsafe { array(self.lights, self.light_count) }?;
        let exists = |texture: u32| texture as usize <= textures.len();
        let materials = slots_of(arena, materials, |material| material.of_core(exists))?;
        let lights = slots_of(arena, lights, HalflightLight::of_core)?;
        // SAFETY: by the caller, each texture has the texels that it says.
        let textures = slots_of(arena, textures, |texture| unsafe { texture.of_core() })?;
        if !exists(self.environment_texture) {
            return Err(HalflightStatus::Light);
        }
        let radiance = Vec3::from(self.environment);
        let map = texture_id(self.environment_texture);
        let environment =
            (radiance.max_element() > 0.0).then_some(Environment { map, ..Environment::uniform(radiance) });
        let camera = self.camera.of_core()?;
        Ok(Scene { mesh, materials, textures, lights, environment, camera })
    }
}

impl HalflightMaterial {
    fn of_core(&self, exists: impl Fn(u32) -> bool) -> Result<Material, HalflightStatus> {
        if !exists(self.color_texture) || !exists(self.emission_texture) {
            return Err(HalflightStatus::Material);
        }
        let tint = Vec3::from(self.color);
        let color = ColorInput { texture: texture_id(self.color_texture), ..tint.into() };
        let ior = if self.ior == 0.0 { 1.5 } else { self.ior };
        let roughness = ScalarInput::from(self.roughness);
        let surface = match self.surface {
            HALFLIGHT_DIFFUSE => Surface::Diffuse { reflectance: color },
            HALFLIGHT_MIRROR => Surface::Mirror { reflectance: color },
            HALFLIGHT_METAL => Surface::Conductor { reflectance: color, roughness },
            HALFLIGHT_COATED => Surface::Glossy {
                base: color,
                specular: Vec3::from(self.specular).into(),
                roughness,
                metallic: self.metallic.into(),
                ior: None,
            },
            HALFLIGHT_GLASS => Surface::Dielectric { ior, tint, roughness },
            HALFLIGHT_PANE => Surface::Pane { ior: ior.max(1.0), tint },
            _ => return Err(HalflightStatus::Material),
        };
        let emission =
            ColorInput { texture: texture_id(self.emission_texture), ..Vec3::from(self.emission).into() };
        let opacity = ScalarInput::from(1.0 - self.transparency);
        Ok(Material { surface, emission, two_sided: self.emits_on_both_sides, opacity, normal_map: None })
    }
}

impl HalflightTexture {
    /// # Safety
    /// The texels exist as long as the scene.
    unsafe fn of_core(&self) -> Result<Texture<'static>, HalflightStatus> {
        let &Self { width, height, .. } = self;
        let texels = width as usize * height as usize;
        // SAFETY: by the caller.
        let texels = match (texels, self.srgb.is_null()) {
            (0, _) => return Err(HalflightStatus::Texture),
            (_, false) => unsafe { array(self.srgb.cast(), texels) }.map(Texels::Srgb8),
            _ => unsafe { array(self.linear.cast(), texels) }.map(Texels::Float),
        };
        let texels = texels.map_err(|_| HalflightStatus::Texture)?;
        let wrap = if self.clamps { Wrap::CLAMP } else { Wrap::REPEAT };
        Ok(Texture { width, height, texels, wrap, transform: TextureTransform::IDENTITY, second_set: false })
    }
}

impl HalflightLight {
    fn of_core(&self) -> Result<PointLight, HalflightStatus> {
        let (position, power) = (Vec3::from(self.position), Vec3::from(self.power));
        let direction = Vec3::from(self.direction).try_normalize().unwrap_or(Vec3::NEG_Y);
        let cos = |degrees: f32| libm::cosf(degrees.to_radians());
        Ok(match self.kind {
            HALFLIGHT_POINT_LIGHT => PointLight::Point { position, intensity: power },
            HALFLIGHT_SPOT_LIGHT => PointLight::Spot {
                position,
                direction,
                intensity: power,
                cos_inner: cos(self.inner_degrees.min(self.outer_degrees)),
                cos_outer: cos(self.outer_degrees),
            },
            HALFLIGHT_DIRECTIONAL_LIGHT => PointLight::Directional { direction, irradiance: power },
            _ => return Err(HalflightStatus::Light),
        })
    }
}

/// Field of view of a camera, at most.
const MOST_DEGREES: f32 = 178.0;

impl HalflightCamera {
    fn of_core(&self) -> Result<Camera, HalflightStatus> {
        if !(0.0..=MOST_DEGREES).contains(&self.vertical_fov_degrees) {
            return Err(HalflightStatus::Setting);
        }
        let [eye, target, up] = [self.eye, self.target, self.up].map(Vec3::from);
        let camera = Camera::look_at(eye, target, up, self.vertical_fov_degrees);
        Ok(Camera { lens_radius: self.lens_radius, focus_distance: self.focus_distance, ..camera })
    }
}

fn texture_id(texture: u32) -> Option<TextureId> {
    texture.checked_sub(1).map(TextureId)
}

/// Memory of `count` values of a type that is no plain data.
fn slots<T>(count: usize) -> Footprint {
    Footprint::default().slice::<u8>(count.saturating_mul(size_of::<T>()))
}

/// The values of `each` element of `from`, in memory of `arena`.
fn slots_of<U, T: 'static>(
    arena: &mut Arena<'static>,
    from: &[U],
    mut each: impl FnMut(&U) -> Result<T, HalflightStatus>,
) -> Result<&'static [T], HalflightStatus> {
    const { assert!(align_of::<T>() <= halflight_core::memory::ALIGNMENT) };
    let bytes = arena.slice::<u8>(from.len().saturating_mul(size_of::<T>()))?;
    let first = bytes.as_mut_ptr().cast::<T>();
    for (index, element) in from.iter().enumerate() {
        let value = each(element)?;
        // SAFETY: the slice is aligned to a cache line and has room for one value of each element.
        unsafe { first.add(index).write(value) };
    }
    // SAFETY: all values are written, and the bytes belong to the arena of the scene.
    Ok(unsafe { core::slice::from_raw_parts(first, from.len()) })
}
