//! Texture lookup from borrowed texels: bilinear, wrapped, decoded to linear. No input panics: coordinates
//! that are not finite count as 0, and a texture without texels is white.

use super::Attributes;
use core::ops::RangeInclusive;
use glam::{Vec2, Vec3, Vec4};
use halflight_simd::kernels::shade::put;
use halflight_simd::kernels::shade::texture::{MAX_SIZE, TextureBlock};

/// Index into the textures of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

/// Texels of a texture, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub enum Texels<'a> {
    /// RGB encoded in sRGB, alpha linear.
    Srgb8(&'a [[u8; 4]]),
    /// Linear values, 0 … 255 for 0 … 1.
    Linear8(&'a [[u8; 4]]),
    /// Linear floats, not limited to 1.
    Float(&'a [[f32; 3]]),
    /// One number for all four channels.
    Number(&'a [f32]),
}

/// Lookup beyond the edges of a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureEdge {
    /// Repeats the texture.
    Repeat,
    /// Extends the border.
    Clamp,
    /// Repeats the texture, every other time mirrored.
    Mirror,
}

/// Lookup beyond the edges along u and v.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wrap(pub [TextureEdge; 2]);

impl Wrap {
    /// Repeats the texture along both sides.
    pub const REPEAT: Self = Self([TextureEdge::Repeat; 2]);

    /// Extends the border of all four edges.
    pub const CLAMP: Self = Self([TextureEdge::Clamp; 2]);
}

/// Map from texture coordinates `uv` of a surface to those of the texture: `scale * uv + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureTransform {
    /// Factors on u and v; a negative one mirrors the texture.
    pub scale: Vec2,
    /// Added after `scale`.
    pub offset: Vec2,
}

impl TextureTransform {
    /// Leaves texture coordinates unchanged.
    pub const IDENTITY: Self = Self { scale: Vec2::ONE, offset: Vec2::ZERO };

    #[inline]
    fn at(&self, uv: Vec2) -> Vec2 {
        self.scale * uv + self.offset
    }
}

/// Texture: borrowed texels with their size.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'a> {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Texels<'a>,
    /// Lookup beyond the edges.
    pub wrap: Wrap,
    /// Map from the texture coordinates of a surface to those of the texture.
    pub transform: TextureTransform,
    /// True if the second set of texture coordinates of a surface is meant.
    pub second_set: bool,
}

impl Texture<'_> {
    /// The texture coordinates of a surface that are meant.
    #[inline]
    pub(crate) fn uv(&self, attributes: &Attributes) -> Vec2 {
        if self.second_set { attributes.uv[1] } else { attributes.uv[0] }
    }

    /// Linear RGBA at texture coordinates `uv`: bilinear between texel centres, v up. Alpha is 1 if the
    /// texels have none.
    #[inline]
    pub fn lookup(&self, uv: Vec2) -> [f32; 4] {
        self.between(self.transform.at(uv))
    }

    /// Linear RGBA at texture coordinates of the texture itself.
    #[inline]
    fn between(&self, uv: Vec2) -> [f32; 4] {
        let Wrap([of_u, of_v]) = self.wrap;
        let (x0, x1, fx) = of_u.neighbours(uv.x, self.width);
        let (y0, y1, fy) = of_v.neighbours(1.0 - uv.y, self.height);
        let (top, bottom) = (y0 as usize * self.width as usize, y1 as usize * self.width as usize);
        let (x0, x1) = (x0 as usize, x1 as usize);
        let [a, b, c, d] = self.four([top + x0, top + x1, bottom + x0, bottom + x1]);
        a.lerp(b, fx).lerp(c.lerp(d, fx), fy).to_array()
    }

    /// Stores the place of a look-up at `uv` as look-up `i` of a block. Returns the texels and their number
    /// across, or `None` if lanes do not look up this texture.
    #[inline]
    pub(crate) fn put(&self, block: &mut TextureBlock, i: usize, uv: Vec2) -> Option<(&[[u8; 4]], usize)> {
        const SIZES: RangeInclusive<u32> = 1..=MAX_SIZE;
        let Texels::Srgb8(texels) = self.texels else { return None };
        let clamps = self.wrap == Wrap::CLAMP;
        let has_wrap = clamps || self.wrap == Wrap::REPEAT;
        if !(has_wrap && SIZES.contains(&self.width) && SIZES.contains(&self.height)) {
            return None;
        }
        let (uv, i) = (self.transform.at(uv), i & 15);
        (block.at[0][i], block.at[1][i]) = (uv.x, 1.0 - uv.y);
        (block.size[0][i], block.size[1][i]) = (self.width as f32, self.height as f32);
        block.clamps = block.clamps & !(1 << i) | u32::from(clamps) << i;
        Some((texels, self.width as usize))
    }

    /// Slope (∂/∂u, ∂/∂v) of the red channel at `uv`, per unit of the texture's own coordinates, for height
    /// maps. Central differences over one texel make it continuous.
    pub fn gradient(&self, uv: Vec2) -> Vec2 {
        let uv = self.transform.at(uv);
        let size = Vec2::new(self.width as f32, self.height as f32);
        let half = 0.5 / size.max(Vec2::ONE);
        let height = |du: f32, dv: f32| self.between(uv + Vec2::new(du, dv))[0];
        Vec2::new(height(half.x, 0.0) - height(-half.x, 0.0), height(0.0, half.y) - height(0.0, -half.y))
            * size
    }

    /// Linear RGBA of the texel in column `x` of row `y` from the top; white if it does not exist.
    pub fn texel_at(&self, x: usize, y: usize) -> [f32; 4] {
        self.texel(y.saturating_mul(self.width as usize).saturating_add(x)).to_array()
    }

    /// Linear texels at four indices; white where there is none. The kind of texel decides once, so that the
    /// memory accesses of all four overlap.
    #[inline]
    fn four(&self, [a, b, c, d]: [usize; 4]) -> [Vec4; 4] {
        match self.texels {
            Texels::Srgb8(texels) => [srgb(texels, a), srgb(texels, b), srgb(texels, c), srgb(texels, d)],
            _ => [self.texel(a), self.texel(b), self.texel(c), self.texel(d)],
        }
    }

    /// Linear texel at `index`; white if it does not exist.
    #[inline]
    fn texel(&self, index: usize) -> Vec4 {
        match self.texels {
            Texels::Srgb8(texels) => srgb(texels, index),
            Texels::Linear8(texels) => match texels.get(index) {
                Some(&[r, g, b, a]) => Vec4::new(r.into(), g.into(), b.into(), a.into()) / 255.0,
                None => Vec4::ONE,
            },
            Texels::Float(texels) => texels.get(index).map_or(Vec4::ONE, |&rgb| Vec3::from(rgb).extend(1.0)),
            Texels::Number(texels) => texels.get(index).map_or(Vec4::ONE, |&number| Vec4::splat(number)),
        }
    }
}

/// Linear texel number `index` of sRGB; white if it does not exist.
#[inline(always)]
fn srgb(texels: &[[u8; 4]], index: usize) -> Vec4 {
    let Some(&[r, g, b, a]) = texels.get(index) else { return Vec4::ONE };
    let linear = |byte: u8| SRGB_TO_LINEAR[byte as usize];
    Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0)
}

/// Loads the texels of look-up `i` of a block, which [`Texture::put`] has returned.
#[inline]
pub(crate) fn load(block: &mut TextureBlock, i: usize, (texels, width): (&[[u8; 4]], usize)) {
    let i = i & 15;
    let (left, right) = (block.first[0][i] as usize, block.second[0][i] as usize);
    let (top, bottom) = (block.first[1][i] as usize * width, block.second[1][i] as usize * width);
    let texel = |index: usize| srgb(texels, index).truncate().to_array();
    put(&mut block.texels[0], i, texel(top + left));
    put(&mut block.texels[1], i, texel(top + right));
    put(&mut block.texels[2], i, texel(bottom + left));
    put(&mut block.texels[3], i, texel(bottom + right));
}

impl TextureEdge {
    /// The two texels around coordinate `x` (0 … 1 spans `size` texels), and the weight of the second.
    #[inline]
    fn neighbours(self, x: f32, size: u32) -> (u32, u32, f32) {
        // Coordinates beyond 2^23 are whole numbers. NaN fails the comparison as well.
        const WHOLE: f32 = 8_388_608.0;
        let x = if x.abs() < WHOLE { x } else { 0.0 };
        let last = size.saturating_sub(1);
        match self {
            TextureEdge::Mirror => {
                let in_pair = x - 2.0 * floor(0.5 * x);
                TextureEdge::Clamp.neighbours(in_pair.min(2.0 - in_pair), size)
            }
            TextureEdge::Repeat => {
                let texel = (x - floor(x)) * size as f32 - 0.5;
                let below = floor(texel);
                let index = below as i32;
                let first = if index < 0 { last } else { (index as u32).min(last) };
                let second = if first == last { 0 } else { first + 1 };
                (first, second, texel - below)
            }
            TextureEdge::Clamp => {
                let texel = (x.clamp(0.0, 1.0) * size as f32 - 0.5).clamp(0.0, last as f32);
                let first = (texel as u32).min(last);
                (first, (first + 1).min(last), texel - first as f32)
            }
        }
    }
}

/// Floor of `x`, for |x| < 2^31: two instructions, whereas `libm` calls a function.
#[inline]
fn floor(x: f32) -> f32 {
    let whole = x as i32 as f32;
    if whole > x { whole - 1.0 } else { whole }
}

/// sRGB decoding (IEC 61966-2-1) of every byte.
static SRGB_TO_LINEAR: [f32; 256] = {
    let mut table = [0.0; 256];
    let mut i = 0;
    while i < 256 {
        let encoded = i as f64 / 255.0;
        table[i] = if encoded <= 0.04045 {
            (encoded / 12.92) as f32
        } else {
            power_12_5((encoded + 0.055) / 1.055) as f32
        };
        i += 1;
    }
    table
};

/// x^2.4 for `x` in 0.05 … 1, at compile time: the twelfth power of the fifth root by Newton's method.
const fn power_12_5(x: f64) -> f64 {
    let mut root = 1.0;
    let mut step = 0;
    while step < 40 {
        root -= (root - x / (root * root * root * root)) / 5.0;
        step += 1;
    }
    let cube = root * root * root;
    cube * cube * cube * cube
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Level;
    use crate::sampling::Random;
    use halflight_simd::kernels::shade::at;

    const IDENTITY: TextureTransform = TextureTransform::IDENTITY;
    const RGBW: [[f32; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];

    fn texture(wrap: Wrap) -> Texture<'static> {
        let (width, height, transform) = (2, 2, IDENTITY);
        Texture { width, height, texels: Texels::Float(&RGBW), wrap, transform, second_set: false }
    }

    #[test]
    fn texel_centres_are_exact_and_v_points_up() {
        for wrap in [Wrap::REPEAT, Wrap::CLAMP] {
            let t = texture(wrap);
            assert_eq!(t.lookup(Vec2::new(0.25, 0.75)), [1.0, 0.0, 0.0, 1.0]);
            assert_eq!(t.lookup(Vec2::new(0.75, 0.75)), [0.0, 1.0, 0.0, 1.0]);
            assert_eq!(t.lookup(Vec2::new(0.25, 0.25)), [0.0, 0.0, 1.0, 1.0]);
            assert_eq!(t.lookup(Vec2::new(0.5, 0.5)), [0.5, 0.5, 0.5, 1.0]);
        }
    }

    #[test]
    fn edges_repeat_or_hold() {
        assert_eq!(texture(Wrap::REPEAT).lookup(Vec2::new(0.0, 0.75)), [0.5, 0.5, 0.0, 1.0]);
        assert_eq!(texture(Wrap::REPEAT).lookup(Vec2::new(-2.75, 3.75)), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(texture(Wrap::CLAMP).lookup(Vec2::new(-5.0, 0.75)), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(texture(Wrap::CLAMP).lookup(Vec2::new(9.0, -9.0)), [1.0, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn sides_wrap_in_their_own_ways() {
        let mirrored = texture(Wrap([TextureEdge::Mirror; 2]));
        let at = |u, v| mirrored.lookup(Vec2::new(u, v));
        for (u, v) in [(0.25, 0.75), (0.4, 0.9), (0.0, 1.0), (0.93, 0.31)] {
            let same = [(-u, v), (2.0 - u, v), (u + 2.0, v - 4.0), (u, 2.0 - v), (-u, -v)];
            for (u2, v2) in same {
                let difference = Vec4::from(at(u, v)).distance(at(u2, v2).into());
                assert!(difference < 1e-5, "{u} {v}, {u2} {v2}");
            }
        }
        // The border is one texel wide, as if clamped.
        assert_eq!(at(0.0, 0.75), [1.0, 0.0, 0.0, 1.0]);
        let mixed = texture(Wrap([TextureEdge::Clamp, TextureEdge::Repeat]));
        assert_eq!(mixed.lookup(Vec2::new(9.0, 3.75)), [0.0, 1.0, 0.0, 1.0]);
        assert_eq!(mixed.lookup(Vec2::new(-1.0, -1.75)), [0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn the_srgb_curve() {
        for (byte, &linear) in SRGB_TO_LINEAR.iter().enumerate() {
            let e = byte as f64 / 255.0;
            let expected = if e <= 0.04045 { e / 12.92 } else { ((e + 0.055) / 1.055).powf(2.4) };
            assert_eq!(linear, expected as f32, "{byte}");
        }
        let texels = [[188, 0, 255, 51]];
        let t = Texture { width: 1, height: 1, texels: Texels::Srgb8(&texels), ..texture(Wrap::REPEAT) };
        let [r, g, b, a] = t.lookup(Vec2::ZERO);
        assert!((r - 0.502_886).abs() < 1e-5 && g == 0.0 && b == 1.0 && a == 0.2);
        let t = Texture { texels: Texels::Linear8(&texels), ..t };
        assert_eq!(t.lookup(Vec2::ZERO), [188.0 / 255.0, 0.0, 1.0, 0.2]);
    }

    #[test]
    fn a_ramp_has_a_constant_slope() {
        let ramp: [[f32; 3]; 32] = core::array::from_fn(|i| [(i % 8) as f32 * 0.5 - (i / 8) as f32; 3]);
        let t = Texture { width: 8, height: 4, texels: Texels::Float(&ramp), ..texture(Wrap::CLAMP) };
        let slope = t.gradient(Vec2::new(0.5, 0.5));
        // Half a unit per texel, 8 texels per unit of u; minus one per row downwards, 4 rows per unit of v.
        assert!(slope.distance(Vec2::new(4.0, 4.0)) < 1e-4, "{slope}");
    }

    #[test]
    fn a_texture_lies_where_its_transform_says() {
        let plain = texture(Wrap::REPEAT);
        let (scale, offset) = (Vec2::new(-2.0, 4.0), Vec2::new(0.25, -0.5));
        let moved = Texture { transform: TextureTransform { scale, offset }, ..plain };
        for uv in [Vec2::ZERO, Vec2::new(0.125, 0.75), Vec2::new(-3.375, 0.0625)] {
            assert_eq!(moved.lookup(uv), plain.lookup(scale * uv + offset));
            assert_eq!(moved.gradient(uv), plain.gradient(scale * uv + offset));
        }
    }

    #[test]
    fn look_ups_of_a_block_have_the_bits_of_single_ones() {
        let texels: [[u8; 4]; 15] = core::array::from_fn(|i| [17 * i as u8, 90 + 11 * i as u8, i as u8, 0]);
        let transform = TextureTransform { scale: Vec2::new(-1.5, 2.0), offset: Vec2::new(0.125, 0.0) };
        let random = Random::new(3, 0);
        for wrap in [Wrap::REPEAT, Wrap::CLAMP] {
            // The last one lacks texels.
            for (width, height) in [(5, 3), (3, 5), (1, 15), (15, 1), (8, 8)] {
                let texels = Texels::Srgb8(&texels);
                let t = Texture { width, height, texels, transform, ..texture(wrap) };
                let (mut block, mut mixture) = (TextureBlock::EMPTY, [[0.0; 16]; 3]);
                let uv: [Vec2; 16] = core::array::from_fn(|i| match i {
                    0 => Vec2::new(f32::NAN, 1e30),
                    _ => 4.0 * Vec2::new(random.single(2 * i as u32), random.single(2 * i as u32 + 1)) - 2.0,
                });
                let found: [_; 16] =
                    core::array::from_fn(|i| t.put(&mut block, i, uv[i]).unwrap_or_default());
                block.surround(Level::detect());
                (0..16).for_each(|i| load(&mut block, i, found[i]));
                block.mix(Level::detect(), &mut mixture);
                for (i, uv) in uv.into_iter().enumerate() {
                    let [r, g, b, _] = t.lookup(uv);
                    assert_eq!(at(&mixture, i), [r, g, b], "{width} {height} {uv}");
                }
            }
        }
    }

    #[test]
    fn wild_coordinates_and_broken_textures() {
        let wild =
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, 8_388_607.5, -1e-9, 1.0 - 1e-8, 0.0];
        let sizes = [(2, 2), (0, 0), (1, 0), (u32::MAX, 1), (1, u32::MAX), (3, 2)];
        for wrap in [Wrap::REPEAT, Wrap::CLAMP, Wrap([TextureEdge::Mirror, TextureEdge::Clamp])] {
            for (width, height) in sizes {
                let t = Texture { width, height, ..texture(wrap) };
                for u in wild {
                    for v in wild {
                        let rgba = t.lookup(Vec2::new(u, v));
                        assert!(
                            rgba.iter().all(|c| (0.0..=1.0).contains(c)),
                            "{width} {height} {u} {v} {rgba:?}"
                        );
                        assert!(t.gradient(Vec2::new(u, v)).is_finite());
                    }
                }
            }
        }
        let none = Texture { width: 4, height: 4, texels: Texels::Float(&[]), ..texture(Wrap::REPEAT) };
        assert_eq!(none.lookup(Vec2::splat(0.3)), [1.0; 4]);
    }
}
