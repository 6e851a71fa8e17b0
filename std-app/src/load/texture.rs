//! Pictures as textures and environment maps: finite values that are not negative, and their views for the
//! core.

use super::notes::Notes;
use crate::picture::{Picture, Samples};
use halflight_core::scene::{Texels, Texture, TextureTransform, Wrap};
use std::path::Path;

/// Least replacement of an infinite texel: the largest half float.
const LARGEST_HALF: f32 = 65504.0;

/// Largest texel: products of a few texels, and the squares that the film sums, stay finite.
const LARGEST: f32 = 1e15;

/// Content of a view of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// Colours.
    Colour,
    /// Numbers.
    Data,
    /// Opacity, in all channels.
    Alpha,
}

/// The picture as a texture: 8 bits or floats, finite and not negative.
pub(super) fn prepared(mut picture: Picture) -> Picture {
    match &mut picture.samples {
        Samples::Bytes(_) => {}
        Samples::Words(words) => {
            // Rounded like the `image` crate.
            let byte = |&word: &u16| ((u32::from(word) + 128) / 257) as u8;
            picture.samples = Samples::Bytes(words.iter().map(byte).collect());
        }
        Samples::Floats { rgb, alpha } => {
            let finite = rgb.as_flattened().iter().copied().filter(|value| value.is_finite());
            let sun = finite.fold(LARGEST_HALF, f32::max).min(LARGEST);
            let [mut broken, mut infinite, mut large] = [0u64; 3];
            for value in rgb.as_flattened_mut() {
                let (usable, count) = match *value {
                    value if value == f32::INFINITY => (sun, &mut infinite),
                    value if value > LARGEST => (LARGEST, &mut large),
                    value if value >= 0.0 => continue,
                    _ => (0.0, &mut broken),
                };
                *value = usable;
                *count += 1;
            }
            for value in alpha.iter_mut() {
                broken += u64::from(!(value.is_finite() && *value >= 0.0));
                *value = value.clamp(0.0, 1.0).max(0.0);
            }
            let notes = [
                (broken, "texels that are NaN or negative are set to 0".to_string()),
                (infinite, format!("infinite texels are set to {sun}")),
                (large, format!("texels above {LARGEST:e} are set to {LARGEST:e}")),
            ];
            for (count, what) in notes.into_iter().filter(|(count, _)| *count > 0) {
                picture.notes.push(if count == 1 { what } else { format!("{what}, {count} times") });
            }
        }
    }
    picture
}

/// Moves the notes of a picture to those of the load.
pub(super) fn note(picture: &mut Picture, name: &Path, notes: &mut Notes) {
    for note in picture.notes.drain(..) {
        notes.add(1, format!("picture {}: {note}", name.display()));
    }
}

/// A view for the core. Bytes are colours in the sRGB curve, or numbers; floats are both.
pub(super) fn view(picture: &Picture, content: Content, wrap: Wrap) -> Texture<'_> {
    let texels = match (&picture.samples, content) {
        (Samples::Floats { alpha, .. }, Content::Alpha) => Texels::Number(alpha),
        (Samples::Floats { rgb, .. }, _) => Texels::Float(rgb),
        (Samples::Bytes(bytes), Content::Colour) => Texels::Srgb8(bytemuck::cast_slice(bytes)),
        (Samples::Bytes(bytes), _) => Texels::Linear8(bytemuck::cast_slice(bytes)),
        // Prepared pictures have none.
        (Samples::Words(_), _) => Texels::Float(&[]),
    };
    let transform = TextureTransform::IDENTITY;
    Texture { width: picture.width, height: picture.height, texels, wrap, transform, second_set: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floats(rgb: Vec<[f32; 3]>, alpha: Vec<f32>) -> Picture {
        let (width, has_alpha) = (rgb.len() as u32, !alpha.is_empty());
        prepared(Picture {
            width,
            height: 1,
            samples: Samples::Floats { rgb, alpha },
            has_alpha,
            notes: Vec::new(),
        })
    }

    #[test]
    fn texels_become_finite_and_not_negative() {
        let odd =
            floats(vec![[1.0, f32::NAN, -2.0], [f32::INFINITY, 3.0, f32::NEG_INFINITY]], vec![2.0, f32::NAN]);
        let rgb = vec![[1.0, 0.0, 0.0], [65504.0, 3.0, 0.0]];
        assert_eq!(odd.samples, Samples::Floats { rgb, alpha: vec![1.0, 0.0] });
        let expected =
            ["texels that are NaN or negative are set to 0, 4 times", "infinite texels are set to 65504"];
        assert_eq!(odd.notes, expected);
        assert_eq!(floats(vec![[0.0, -0.0, 1e15]], vec![1.0]).notes, [""; 0]);
    }

    #[test]
    fn infinite_texels_become_the_brightest() {
        let of = |brightest: f32| match floats(vec![[f32::INFINITY, brightest, 0.0]], vec![]).samples {
            Samples::Floats { rgb, .. } => rgb[0],
            other => panic!("{other:?}"),
        };
        assert_eq!(of(3e6), [3e6, 3e6, 0.0]);
        assert_eq!(of(f32::MAX), [LARGEST, LARGEST, 0.0]);
    }

    #[test]
    fn sixteen_bits_become_eight() {
        let words = Picture {
            width: 1,
            height: 1,
            samples: Samples::Words(vec![0, 65535, 257 * 7, 257 * 7 + 129]),
            has_alpha: true,
            notes: Vec::new(),
        };
        assert_eq!(prepared(words).samples, Samples::Bytes(vec![0, 255, 7, 8]));
    }
}
