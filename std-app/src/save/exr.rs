//! OpenEXR files: a picture, layers beside it, and attributes.
//!
//! The picture is the first part, alone: some readers refuse a first part with other channels than R, G, B
//! and A. Each layer is a part of its own with the name of the layer, which its channels repeat: some readers
//! put the name of a part before those of its channels, unless it stands there. Attributes stand in the
//! headers of all parts, because some readers look into the first alone.

use super::Image;
use halflight_core::film::PixelWindow;

/// Value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// UTF-8 text.
    Text(String),
    /// Real number.
    Number(f32),
    /// Whole number.
    Integer(i32),
    /// Lower and upper end.
    Interval([f32; 2]),
}

/// Value of a channel at the pixel of an index, row by row from the top.
pub(super) type Value<'i> = Box<dyn Fn(usize) -> f32 + Sync + 'i>;

/// An OpenEXR file under construction.
pub struct ExrFile<'i> {
    pub(super) image: &'i Image,
    /// Channel A of the picture.
    pub(super) alpha: Option<Value<'i>>,
    /// Channels beside the picture.
    pub(super) layers: Vec<(String, Value<'i>)>,
    pub(super) attributes: Vec<(String, Attribute)>,
    /// The window of a larger picture that this one is.
    pub(super) window: Option<PixelWindow>,
}

impl<'i> ExrFile<'i> {
    /// A file of one picture.
    pub fn of(image: &'i Image) -> Self {
        Self { image, alpha: None, layers: Vec::new(), attributes: Vec::new(), window: None }
    }

    /// Gives the picture a channel A, with its value at the pixel of an index, row by row from the top.
    pub fn set_alpha(&mut self, value: impl Fn(usize) -> f32 + Sync + 'i) {
        self.alpha = Some(Box::new(value));
    }

    /// Makes the picture a window of a larger one, which is the display window of the file.
    pub fn set_window(&mut self, window: PixelWindow) {
        self.window = Some(window);
    }

    /// Adds an attribute, or replaces the one of this name.
    pub fn set(&mut self, name: impl Into<String>, value: Attribute) {
        self.attributes.push((name.into(), value));
    }

    /// Adds a channel, such as `depth.Z`, with its value at the pixel of an index, row by row from the top.
    pub fn add_channel(&mut self, name: impl Into<String>, value: impl Fn(usize) -> f32 + Sync + 'i) {
        self.layers.push((name.into(), Box::new(value)));
    }

    /// Adds three channels: `name`, a dot, and each letter of `letters`.
    pub fn add_channels(
        &mut self,
        name: &str,
        letters: [char; 3],
        value: impl Fn(usize) -> [f32; 3] + Sync + Clone + 'i,
    ) {
        for (channel, letter) in letters.into_iter().enumerate() {
            let value = value.clone();
            self.add_channel(format!("{name}.{letter}"), move |pixel| value(pixel)[channel]);
        }
    }

    /// Names of the channels beside the picture, and their values, row by row from the top.
    pub fn channels(&self) -> impl Iterator<Item = (&str, Vec<f32>)> {
        let pixels = self.image.pixels.len();
        self.layers.iter().map(move |(name, value)| (&**name, (0..pixels).map(value).collect()))
    }
}
