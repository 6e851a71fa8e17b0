//! Classification of relief maps by their texels: heights or normals. Exporters use one statement for both:
//! Blender writes normals as `map_Bump`.

use halflight_core::scene::Texture;

/// Texels that are examined, along each side.
const MOST_TEXELS: u32 = 64;
/// Difference of the channels of a grey texel: a few steps of 8 bits, for JPEG.
const GREY: f32 = 0.03;
/// Fraction of texels that must agree.
const NEARLY_ALL: f32 = 0.95;

/// Kinds of relief map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relief {
    /// Grey everywhere, which maps of directions are not.
    Heights,
    /// Unit vectors around the third axis.
    Normals,
    /// Neither; the statement decides.
    Unclear,
}

/// The kind of a texture of numbers.
pub(super) fn classify(texture: &Texture) -> Relief {
    let positions = |size: u32| {
        let count = size.min(MOST_TEXELS);
        (0..count).map(move |i| ((u64::from(i) * 2 + 1) * u64::from(size) / (2 * u64::from(count))) as usize)
    };
    let [mut texels, mut grey, mut unit] = [0u32; 3];
    let mut sum = [0.0f32; 3];
    for y in positions(texture.height) {
        for x in positions(texture.width) {
            let [r, g, b, _] = texture.texel_at(x, y);
            texels += 1;
            grey += u32::from(r.max(g).max(b) - r.min(g).min(b) <= GREY);
            let normal = [r, g, b].map(|c| 2.0 * c - 1.0);
            let square: f32 = normal.iter().map(|c| c * c).sum();
            // Normals of filtered and compressed maps are shorter, those that store z as 1 longer.
            unit += u32::from((0.5..2.1).contains(&square) && normal[2] >= -0.1);
            sum.iter_mut().zip([r, g, b]).for_each(|(sum, c)| *sum += c);
        }
    }
    let most = NEARLY_ALL * texels as f32;
    let [r, g, b] = sum.map(|sum| sum / texels.max(1) as f32);
    let is_centred = |c: f32| (c - 0.5).abs() <= 0.15;
    match texels {
        0 => Relief::Unclear,
        _ if grey as f32 >= most => Relief::Heights,
        _ if unit as f32 >= most && is_centred(r) && is_centred(g) && b >= 0.7 => Relief::Normals,
        _ => Relief::Unclear,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::scene::{Texels, TextureTransform, Wrap};

    fn of(texel: impl Fn(f32) -> [f32; 3]) -> Relief {
        let byte = |c: f32| (255.0 * c.clamp(0.0, 1.0)).round() as u8;
        let texels: Vec<[u8; 4]> = (0..256)
            .map(|i| texel((i as f32 * 0.7).sin()).map(byte))
            .map(|[r, g, b]| [r, g, b, 255])
            .collect();
        classify(&square(16, &texels))
    }

    fn square(size: u32, texels: &[[u8; 4]]) -> Texture<'_> {
        let transform = TextureTransform::IDENTITY;
        Texture {
            width: size,
            height: size,
            texels: Texels::Linear8(texels),
            wrap: Wrap::REPEAT,
            transform,
            second_set: false,
        }
    }

    /// A normal with slope `x` along u, in 0 ... 1.
    fn normal(x: f32) -> [f32; 3] {
        let length = (x * x + 0.01 + 1.0).sqrt();
        [x / length, 0.1 / length, 1.0 / length].map(|c| 0.5 * c + 0.5)
    }

    #[test]
    fn grey_is_height_and_unit_vectors_are_normals() {
        assert_eq!(of(|x| [0.5 + 0.5 * x; 3]), Relief::Heights);
        assert_eq!(of(|_| [0.5, 0.5, 1.0]), Relief::Normals);
        assert_eq!(of(|x| normal(0.2 * x)), Relief::Normals);
        assert_eq!(of(|x| normal(1.5 * x)), Relief::Normals);
        assert_eq!(of(|x| [0.6 + 0.3 * x, 0.4 + 0.2 * x, 0.2]), Relief::Unclear);
        assert_eq!(of(|x| [0.3, 0.5, 0.8 + 0.1 * x]), Relief::Unclear);
        assert_eq!(classify(&square(0, &[])), Relief::Unclear);
    }
}
