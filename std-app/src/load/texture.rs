//! Pictures that become textures and skies: their numbers made finite and not negative, and the views of them
//! that the core sees.

use crate::picture::{Picture, Samples};
use halflight_core::scene::{Texels, Texture, TextureTransform, Wrap};

/// What an infinite texel becomes where nothing in the picture is brighter: the largest half float.
const LARGEST_HALF: f32 = 65504.0;

/// No texel is larger: products of a few of them, and the squares that the film sums, stay finite.
const LARGEST: f32 = 1e15;

/// Which numbers of a picture a view shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// Colours.
    Colour,
    /// Plain numbers.
    Data,
    /// Opacity, in all channels.
    Alpha,
}

/// The picture as textures have it: 8 bits or floats, no number that light cannot be.
pub(super) fn prepared(mut picture: Picture) -> Picture {
    match &mut picture.samples {
        Samples::Bytes(_) => {}
        Samples::Words(words) => {
            // As `image` rounds them.
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
                (broken, "numbers that are not finite or negative are 0 now".to_string()),
                (infinite, format!("infinite numbers are {sun} now")),
                (large, format!("numbers above {LARGEST:e} are {LARGEST:e} now")),
            ];
            for (count, what) in notes.into_iter().filter(|(count, _)| *count > 0) {
                picture.notes.push(if count == 1 { what } else { format!("{what}, {count} times") });
            }
        }
    }
    picture
}

/// The picture as the core sees it. Bytes are colours in the sRGB curve, or plain numbers; floats are both.
pub(super) fn view(picture: &Picture, shown: Shown, wrap: Wrap) -> Texture<'_> {
    let texels = match (&picture.samples, shown) {
        (Samples::Floats { alpha, .. }, Shown::Alpha) => Texels::Number(alpha),
        (Samples::Floats { rgb, .. }, _) => Texels::Float(rgb),
        (Samples::Bytes(bytes), Shown::Colour) => Texels::Srgb8(bytemuck::cast_slice(bytes)),
        (Samples::Bytes(bytes), _) => Texels::Linear8(bytemuck::cast_slice(bytes)),
        // There are none once they are prepared.
        (Samples::Words(_), _) => Texels::Float(&[]),
    };
    let transform = TextureTransform::IDENTITY;
    Texture { width: picture.width, height: picture.height, texels, wrap, transform }
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
    fn numbers_are_what_light_can_be() {
        let odd =
            floats(vec![[1.0, f32::NAN, -2.0], [f32::INFINITY, 3.0, f32::NEG_INFINITY]], vec![2.0, f32::NAN]);
        let rgb = vec![[1.0, 0.0, 0.0], [65504.0, 3.0, 0.0]];
        assert_eq!(odd.samples, Samples::Floats { rgb, alpha: vec![1.0, 0.0] });
        let expected =
            ["numbers that are not finite or negative are 0 now, 4 times", "infinite numbers are 65504 now"];
        assert_eq!(odd.notes, expected);
        assert_eq!(floats(vec![[0.0, -0.0, 1e15]], vec![1.0]).notes, [""; 0]);
    }

    #[test]
    fn the_sun_is_no_darker_than_anything_else() {
        let of = |brightest: f32| match floats(vec![[f32::INFINITY, brightest, 0.0]], vec![]).samples {
            Samples::Floats { rgb, .. } => rgb[0],
            other => panic!("{other:?}"),
        };
        assert_eq!(of(3e6), [3e6, 3e6, 0.0]);
        assert_eq!(of(f32::MAX), [LARGEST, LARGEST, 0.0]);
    }

    #[test]
    fn words_become_bytes() {
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
