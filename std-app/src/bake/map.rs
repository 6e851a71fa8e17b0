//! Texels of a lightmap and their files: EXR with coverage, HDR, PFM.

use crate::save::{self, ExrFile, FileError, Format, Image};

/// Values of a texel in all layers; the first alone, or the constant and the gradient along x, y and z.
pub(super) type Fetch = [[f32; 3]; 4];

/// Coverage of a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Texel {
    /// Outside of all charts and their padding.
    #[default]
    Empty,
    /// Mean of its neighbours.
    Filled,
    /// Estimated.
    Computed,
}

/// A map of irradiances, in rows from the top, where v is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMap {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Values of each layer: the irradiance, or four layers for a + b·n: a, and b along x, y and z.
    pub layers: Vec<Vec<[f32; 3]>>,
    /// Half-width of the 95 % interval of the luminance of each texel.
    pub half_widths: Vec<f32>,
    /// Coverage.
    pub texels: Vec<Texel>,
}

impl LightMap {
    /// Bytes of a texel, and of the picture that is written.
    pub(super) fn bytes_of_texel(layers: usize) -> usize {
        layers * size_of::<[f32; 3]>() + 2 * size_of::<f32>() + size_of::<Texel>() + layers * 2 * 16
    }

    pub(super) fn empty(size: [u32; 2], layers: usize) -> Self {
        let count = size[0] as usize * size[1] as usize;
        let layers = vec![vec![[0.0; 3]; count]; layers];
        Self { size, layers, half_widths: vec![0.0; count], texels: vec![Texel::Empty; count] }
    }

    /// Adds the values of a point of `texel`.
    pub(super) fn add(&mut self, texel: usize, fetch: &Fetch, half_width: f32) {
        for (layer, values) in self.layers.iter_mut().zip(fetch) {
            layer[texel].iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        self.half_widths[texel] = self.half_widths[texel].hypot(half_width);
        self.texels[texel] = Texel::Computed;
    }

    /// Means of texels with so many points, times `scale`.
    pub(super) fn divide(&mut self, counts: &[u32], scale: f32) {
        for (texel, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let factor = scale / *count as f32;
            for layer in &mut self.layers {
                layer[texel] = layer[texel].map(|sum| sum * factor);
            }
            self.half_widths[texel] *= factor;
        }
    }

    /// Slopes along x, y and z become ½ + slope / (8 × constant) along y, z and x.
    pub(super) fn encode_slopes(&mut self) {
        let [constant, slopes @ ..] = &mut self.layers[..] else { return };
        for (slope, constant) in slopes.iter_mut().flat_map(|layer| layer.iter_mut().zip(&*constant)) {
            for (slope, constant) in slope.iter_mut().zip(constant) {
                let ratio = if *constant > 0.0 { *slope / (8.0 * constant) } else { 0.0 };
                *slope = (0.5 + ratio).clamp(0.0, 1.0);
            }
        }
        slopes.rotate_left(1);
    }

    /// Gives `texel` the mean of others.
    pub(super) fn take(&mut self, texel: usize, from: &[usize]) {
        let each = 1.0 / from.len() as f32;
        for layer in &mut self.layers {
            let sum = |channel: usize| from.iter().map(|&other| layer[other][channel]).sum::<f32>();
            layer[texel] = [sum(0), sum(1), sum(2)].map(|sum| sum * each);
        }
        self.half_widths[texel] = from.iter().map(|&other| self.half_widths[other]).sum::<f32>() * each;
        self.texels[texel] = Texel::Filled;
    }

    /// Number of texels of this coverage.
    pub fn count(&self, coverage: Texel) -> usize {
        self.texels.iter().filter(|texel| **texel == coverage).count()
    }

    /// The bytes of a picture of the values, with the layers one below the other.
    ///
    /// # Errors
    /// A PNG, whose values are no light, or an HDR of gradients, which may be negative; too many texels.
    pub fn encode(&self, format: Format) -> Result<Vec<u8>, FileError> {
        check(format, self.layers.iter().flatten().flatten().any(|value| *value < 0.0))?;
        self.encode_pixels(self.layers.concat(), format)
    }

    /// The bytes of a picture of the half-widths in all channels.
    ///
    /// # Errors
    /// A PNG; too many texels.
    pub fn encode_error(&self, format: Format) -> Result<Vec<u8>, FileError> {
        check(format, false)?;
        self.encode_pixels(self.half_widths.iter().map(|half| [*half; 3]).collect(), format)
    }

    fn encode_pixels(&self, pixels: Vec<[f32; 3]>, format: Format) -> Result<Vec<u8>, FileError> {
        let [width, height] = [self.size[0], (pixels.len() / self.size[0] as usize) as u32];
        let image = Image { width, height, pixels };
        match format {
            Format::Exr => self.encode_exr(&image),
            _ => save::encode(&image, format),
        }
    }

    /// R, G, B, and coverage as A: 1 for computed texels, ½ for filled ones.
    fn encode_exr(&self, image: &Image) -> Result<Vec<u8>, FileError> {
        let mut file = ExrFile::of(image);
        file.set_alpha(|place| match self.texels[place % self.texels.len()] {
            Texel::Empty => 0.0,
            Texel::Filled => 0.5,
            Texel::Computed => 1.0,
        });
        file.encode()
    }
}

/// Checks that a map can be a picture of `format`.
///
/// # Errors
/// A PNG, whose values are no light; an HDR of values that may be negative.
pub fn check(format: Format, is_signed: bool) -> Result<(), FileError> {
    match format {
        Format::Png => Err(FileError::new("a PNG has no room for light: a lightmap is .exr, .hdr or .pfm")),
        Format::Hdr if is_signed => {
            Err(FileError::new("an HDR has no negative values: a directional lightmap is .exr or .pfm"))
        }
        _ => Ok(()),
    }
}
