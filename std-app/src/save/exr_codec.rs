//! The bytes of OpenEXR files, by the `exr` crate.

use super::exr::{Attribute, ExrFile, Value};
use super::{FileError, Image};
use crate::picture::{MAX_PIXELS, fail};
use exr::block::lines::LineRefMut;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::channels::{ChannelsWriter, WritableChannels};
use exr::image::{Blocks, Encoding, Layer};
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, ChannelList, IntegerBounds, LevelMode, SampleType, Text,
};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{Compression, LineOrder, WritableImage};
use std::io::Cursor;

/// Encoding of OpenEXR files.
const EXR: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

impl ExrFile<'_> {
    /// The bytes of the file.
    ///
    /// # Errors
    /// A picture without pixels or with more than [`MAX_PIXELS`], or of another size than its window.
    pub fn encode(self) -> Result<Vec<u8>, FileError> {
        let Image { width, height, pixels } = self.image;
        if pixels.is_empty() || pixels.len() > MAX_PIXELS {
            fail!("{width}x{height} pixels cannot be written");
        }
        let size = self.window.map(|window| window.size());
        if let Some(size) = size.filter(|size| *size != [*width, *height]) {
            fail!("{width}x{height} pixels are no window of {}x{} pixels", size[0], size[1]);
        }
        encode(self)
    }
}

/// The bytes of a file of at least one pixel.
fn encode(file: ExrFile) -> Result<Vec<u8>, FileError> {
    let ExrFile { image, alpha, mut layers, attributes, window } = file;
    let Image { width, height, pixels } = image;
    let size = Vec2(*width as usize, *height as usize);
    let channel = |channel: usize| -> Value { Box::new(move |pixel| pixels[pixel][channel]) };
    let colours = [("B", 2), ("G", 1), ("R", 0)].map(|(name, at)| (name.to_owned(), channel(at)));
    let alpha = alpha.into_iter().map(|alpha| ("A".to_owned(), alpha));
    let picture = Channels { list: alpha.chain(colours).collect(), width: size.x() };
    layers.sort_by(|(a, _), (b, _)| a.as_bytes().cmp(b.as_bytes()));
    let [across, down] = window.map_or([*width, *height], |window| window.frame());
    let [left, top] = window.map_or([0; 2], |window| window.corner());
    let frame = IntegerBounds::from_dimensions(Vec2(across as usize, down as usize));
    let mut of_image = ImageAttributes::new(frame);
    let position = Vec2(left as i32, top as i32);
    let mut of_part = LayerAttributes { layer_position: position, ..LayerAttributes::default() };
    for (name, value) in attributes {
        // These have fields of their own, and no other place.
        match (name.as_str(), value) {
            ("software", Attribute::Text(value)) => of_part.software_name = Some(text(&value)),
            ("capDate", Attribute::Text(value)) => of_part.capture_date = Some(text(&value)),
            ("utcOffset", Attribute::Number(value)) => of_part.utc_offset = Some(value),
            (name, value) => drop(of_image.other.insert(text(name), value.into())),
        }
    }
    let part = |name: Option<&str>, channel_data| Layer {
        channel_data,
        attributes: LayerAttributes { layer_name: name.map(text), ..of_part.clone() },
        size,
        encoding: EXR,
    };
    let mut parts = vec![part((!layers.is_empty()).then_some(PICTURE), picture)];
    while let Some((name, _)) = layers.first() {
        let name = layer_of(name).to_owned();
        let count = layers.iter().take_while(|(other, _)| layer_of(other) == name).count();
        let list = layers.drain(..count).collect();
        parts.push(part(Some(&name), Channels { list, width: size.x() }));
    }
    let parts = exr::image::Image { attributes: of_image, layer_data: exr::image::Layers::from(parts) };
    let mut bytes = Vec::new();
    // In parallel `exr` starts threads of its own.
    parts.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).map_err(FileError::new)?;
    Ok(bytes)
}

/// Name of the part of the picture in a file with layers.
const PICTURE: &str = "beauty";

/// Layer of a channel: its name up to the last dot.
fn layer_of(channel: &str) -> &str {
    channel.rsplit_once('.').map_or(channel, |(layer, _)| layer)
}

/// Text of OpenEXR, which is UTF-8.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

impl From<Attribute> for AttributeValue {
    fn from(value: Attribute) -> Self {
        match value {
            Attribute::Text(value) => Self::Text(text(&value)),
            Attribute::Number(number) => Self::F32(number),
            Attribute::Integer(number) => Self::I32(number),
            Attribute::Interval([lower, upper]) => Self::FloatVec2(Vec2(lower, upper)),
        }
    }
}

/// Channels of a part, sorted by name as OpenEXR requires.
struct Channels<'i> {
    list: Vec<(String, Value<'i>)>,
    /// Pixels of a row.
    width: usize,
}

impl<'s, 'i: 's> WritableChannels<'s> for Channels<'i> {
    type Writer = Writer<'s, 'i>;

    fn infer_channel_list(&self) -> ChannelList {
        let channel =
            |(name, _): &(String, Value)| ChannelDescription::new(text(name), SampleType::F32, true);
        ChannelList::new(self.list.iter().map(channel).collect())
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'s self, _: &Header) -> Self::Writer {
        Writer(self)
    }
}

struct Writer<'s, 'i>(&'s Channels<'i>);

impl ChannelsWriter for Writer<'_, '_> {
    fn extract_uncompressed_block(&self, header: &Header, block: BlockIndex) -> Vec<u8> {
        let line = |line: LineRefMut| {
            let (at, value) = (line.location.position, &self.0.list[line.location.channel].1);
            let first = at.y() * self.0.width + at.x();
            // The line has room for its samples.
            let _ = line.write_samples(|sample| value(first + sample));
        };
        UncompressedBlock::collect_block_data_from_lines(&header.channels, block, line)
    }
}
