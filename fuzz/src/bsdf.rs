//! BSDFs of any material and texture for any directions: no NaN, no negative light, and densities that agree
//! with samples.

use crate::numbers::{coordinate, fraction, point};
use arbitrary::{Result, Unstructured};
use glam::{Vec2, Vec3};
use halflight_core::Rgb;
use halflight_core::bsdf::{All, Bsdf};
use halflight_core::sampling::warp::uniform_sphere;
use halflight_core::scene::{
    Attributes, Camera, ColorInput, Material, Mesh, ScalarInput, Scene, Surface, Texels, Texture, TextureId,
    TextureTransform, Wrap,
};

/// Largest deviation of a unit vector's length from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let [width, height]: [u32; 2] = [input.int_in_range(0..=3)?, input.int_in_range(0..=3)?];
    let floats = (0..input.int_in_range(0..=9)?).map(|_| point(input)).collect::<Result<Vec<_>>>()?;
    let bytes = input.arbitrary::<[[u8; 4]; 4]>()?;
    let second_set = input.arbitrary()?;
    let wrap = if input.arbitrary()? { Wrap::REPEAT } else { Wrap::CLAMP };
    // A texture with fewer texels than its size promises is the caller's mistake, and must not crash.
    let textures = [Texels::Float(&floats), Texels::Srgb8(&bytes), Texels::Linear8(&bytes)].map(|texels| {
        Texture { width, height, texels, wrap, transform: TextureTransform::IDENTITY, second_set }
    });
    let mesh = Mesh::default();
    let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40.0);
    let scene = Scene { mesh, materials: &[], textures: &textures, lights: &[], environment: None, camera };
    let material = Material { surface: surface(input)?, ..Material::GREY };
    let mut uv = || Ok::<_, arbitrary::Error>(Vec2::new(coordinate(input)?, coordinate(input)?));
    let uv = [uv()?, uv()?];
    let attributes = Attributes { uv, color: point(input)?.into(), alpha: fraction(input)? };
    let bsdf = Bsdf::at::<All>(&scene, &material, &attributes, input.arbitrary()?);

    let mut wo = uniform_sphere([fraction(input)?, fraction(input)?]);
    // Normal incidence and grazing directions are the limits of the formulas.
    wo.z = match input.arbitrary::<u8>()? {
        0 => 1.0,
        1 => f32::MIN_POSITIVE,
        2 => 1e-6,
        _ => wo.z.abs().max(1e-30),
    };
    let mut wo = if wo.z == 1.0 { Vec3::Z } else { wo.normalize_or(Vec3::Z) };
    wo.z = wo.z.max(1e-30);
    check(&bsdf, wo, [fraction(input)?, fraction(input)?, fraction(input)?]);
    let wi = uniform_sphere([fraction(input)?, fraction(input)?]);
    evaluated(&bsdf, wo, wi);
    Ok(())
}

fn check(bsdf: &Bsdf, wo: Vec3, u: [f32; 3]) {
    let Some(sample) = bsdf.sample::<All>(wo, u) else { return };
    let context = || format!("{bsdf:?} wo {wo:?} u {u:?}: {sample:?}");
    assert!((sample.direction.length() - 1.0).abs() < UNIT_TOLERANCE, "{}", context());
    assert!(good(sample.weight), "{}", context());
    assert!(sample.pdf > 0.0 && sample.pdf < f32::INFINITY, "{}", context());
    assert_eq!(sample.direction.z < 0.0, sample.transmitted, "{}", context());
    let (_, pdf) = evaluated(bsdf, wo, sample.direction);
    // Only wide lobes, whose density does not change by the rounding of a direction.
    if !sample.delta && sample.pdf < 100.0 && sample.direction.z.abs() > 1e-3 && wo.z > 1e-3 {
        let ratio = pdf / sample.pdf;
        assert!((0.9..1.1).contains(&ratio), "pdf {pdf} evaluated; {}", context());
    }
}

fn evaluated(bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
    let (value, pdf) = bsdf.evaluate::<All>(wo, wi);
    assert!(good(value) && (0.0..f32::INFINITY).contains(&pdf), "{bsdf:?} {wo:?} {wi:?}: {value} {pdf}");
    (value, pdf)
}

fn good(color: Rgb) -> bool {
    color.is_finite() && color.min_element() >= 0.0
}

fn surface(input: &mut Unstructured) -> Result<Surface> {
    Ok(match input.int_in_range(0..=5)? {
        0 => Surface::Diffuse { reflectance: color(input)? },
        1 => Surface::Mirror { reflectance: color(input)? },
        2 => Surface::Conductor { reflectance: color(input)?, roughness: scalar(input)? },
        4 => Surface::Pane { ior: 1.0 + 0.1 * coordinate(input)?, tint: color(input)?.value },
        3 => Surface::Glossy {
            base: color(input)?,
            specular: color(input)?,
            roughness: scalar(input)?,
            metallic: scalar(input)?,
            ior: if input.arbitrary()? { Some(0.5 + 2.0 * coordinate(input)?) } else { None },
        },
        _ => Surface::Dielectric {
            ior: 1.0 + 0.1 * coordinate(input)?,
            tint: color(input)?.value,
            roughness: scalar(input)?,
        },
    })
}

fn color(input: &mut Unstructured) -> Result<ColorInput> {
    let value = Rgb::new(scalar(input)?.value, fraction(input)?, fraction(input)?);
    let texture = texture(input)?;
    Ok(ColorInput { value, texture, vertex_color: input.arbitrary()? })
}

/// Mostly within 0 … 1.
fn scalar(input: &mut Unstructured) -> Result<ScalarInput> {
    let value = if input.ratio(7, 8)? { fraction(input)? } else { coordinate(input)? };
    let texture = texture(input)?.map(|id| (id, (id.0 * 3 % 5) as u8));
    Ok(ScalarInput { value, texture, vertex_alpha: input.arbitrary()? })
}

fn texture(input: &mut Unstructured) -> Result<Option<TextureId>> {
    Ok(Some(TextureId(input.int_in_range(0..=11)?)).filter(|id| id.0 < 4))
}
