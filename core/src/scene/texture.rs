//! Borrowed texels and how they are looked up: bilinear, wrapped, decoded to linear.

/// Index into the textures of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

/// The pixels of a texture, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub enum Texels<'a> {
    /// RGB in the sRGB curve, alpha linear.
    Srgb8(&'a [[u8; 4]]),
    /// Linear numbers, 0 … 255 for 0 … 1.
    Linear8(&'a [[u8; 4]]),
    /// Linear floats, not limited to 1.
    Float(&'a [[f32; 3]]),
}

/// What lies beyond the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    Repeat,
    /// Its border.
    Clamp,
}

/// A texture: borrowed texels with their size.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'a> {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Texels<'a>,
    /// Beyond the edge.
    pub wrap: Wrap,
}
