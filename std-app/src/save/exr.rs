//! OpenEXR: written as f32 RGB, ZIP compressed; read with half, float or integer channels, any lossless
//! or lossy compression that the `exr` crate knows, any layer names and any data window.

use super::{Image, PictureError, plausible};
use exr::image::{AnyChannels, Encoding, FlatSamples, Layer, SpecificChannels};
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{Compression, LineOrder, ReadChannels, ReadLayers, WritableImage};
use std::io::Cursor;

/// Channels that one file may carry: the 3 that are wanted share memory with all the others.
const MAX_CHANNELS: usize = 256;

/// Samples, channels included, that one byte may stand for: 1032 bytes of deflate are 516 halves.
const SAMPLES_PER_BYTE: usize = 1032;

/// Pictures up to this many samples are read by one thread: starting more costs longer.
const SINGLE_THREAD: usize = 1 << 20;

pub(super) fn encode(image: &Image) -> Result<Vec<u8>, PictureError> {
    let size = Vec2(image.width as usize, image.height as usize);
    let pixel = |at: Vec2<usize>| {
        let [r, g, b] = image.pixels[at.y() * size.x() + at.x()];
        (r, g, b)
    };
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: exr::image::Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut bytes = Vec::new();
    exr::image::Image::from_encoded_channels(size, encoding, SpecificChannels::rgb(pixel))
        .write()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(PictureError::new)?;
    Ok(bytes)
}

pub(super) fn decode(bytes: &[u8]) -> Result<Image, PictureError> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(PictureError::new)?;
    let mut samples = 0usize;
    for header in &meta.headers {
        check(header, bytes.len())?;
        let area = header.layer_size.x() * header.layer_size.y();
        samples = samples.saturating_add(area.saturating_mul(header.channels.list.len()));
    }
    if samples > bytes.len().saturating_mul(SAMPLES_PER_BYTE) {
        let length = bytes.len();
        return Err(PictureError::new(format!(
            "it claims {samples} samples but is only {length} bytes long"
        )));
    }
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().all_layers();
    let reader = reader.all_attributes();
    let reader = if samples < SINGLE_THREAD { reader.non_parallel() } else { reader };
    let file = reader.from_buffered(Cursor::new(bytes)).map_err(PictureError::new)?;

    let display = file.attributes.display_window;
    let (width, height) = (display.size.x(), display.size.y());
    plausible(width, height, bytes.len())?;
    let layers = &file.layer_data;
    let (layer, colour) = [rgb as fn(&Channels) -> _, luminance, single]
        .iter()
        .find_map(|choose| layers.iter().find_map(|layer| choose(&layer.channel_data).map(|c| (layer, c))))
        .ok_or_else(|| PictureError::new(format!("no R, G, B, no Y, but {}", names(layers))))?;

    let mut image = Image::black(width as u32, height as u32);
    let origin = [
        i64::from(layer.attributes.layer_position.x()) - i64::from(display.position.x()),
        i64::from(layer.attributes.layer_position.y()) - i64::from(display.position.y()),
    ];
    let stored =
        |c: usize, index: usize| layer.channel_data.list[colour[c]].sample_data.value_by_flat_index(index);
    for y in 0..layer.size.y() {
        let to_y = origin[1] + y as i64;
        if !(0..height as i64).contains(&to_y) {
            continue;
        }
        let row = &mut image.pixels[to_y as usize * width..][..width];
        for x in 0..layer.size.x() {
            let Some(pixel) = usize::try_from(origin[0] + x as i64).ok().and_then(|x| row.get_mut(x)) else {
                continue;
            };
            let index = y * layer.size.x() + x;
            *pixel = core::array::from_fn(|c| stored(c, index).to_f32());
        }
    }
    Ok(image)
}

type Channels = AnyChannels<FlatSamples>;

fn check(header: &Header, bytes: usize) -> Result<(), PictureError> {
    let display = header.shared_attributes.display_window.size;
    plausible(header.layer_size.x(), header.layer_size.y(), bytes)?;
    plausible(display.x(), display.y(), bytes)?;
    if header.deep {
        return Err(PictureError::new("deep pictures are not supported"));
    }
    if header.channels.list.len() > MAX_CHANNELS {
        return Err(PictureError::new(format!("more than {MAX_CHANNELS} channels are not supported")));
    }
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(PictureError::new("subsampled channels (luminance and chroma) are not supported"));
    }
    Ok(())
}

/// Positions of R, G and B, bare or at the end of a layer's name (`diffuse.R`).
fn rgb(channels: &Channels) -> Option<[usize; 3]> {
    let ending = |prefix: &str, colour: &str| {
        channels.list.iter().position(|channel| channel.name.to_string() == format!("{prefix}{colour}"))
    };
    let prefixes =
        channels.list.iter().filter_map(|c| c.name.to_string().strip_suffix('R').map(str::to_owned));
    core::iter::once(String::new())
        .chain(prefixes.filter(|prefix| prefix.is_empty() || prefix.ends_with('.')))
        .find_map(|prefix| Some([ending(&prefix, "R")?, ending(&prefix, "G")?, ending(&prefix, "B")?]))
}

fn luminance(channels: &Channels) -> Option<[usize; 3]> {
    let y = channels.list.iter().position(|channel| channel.name.to_string() == "Y")?;
    Some([y; 3])
}

fn single(channels: &Channels) -> Option<[usize; 3]> {
    (channels.list.len() == 1).then_some([0; 3])
}

fn names(layers: &[Layer<Channels>]) -> String {
    let names = layers.iter().flat_map(|layer| layer.channel_data.list.iter().map(|c| c.name.to_string()));
    let names: Vec<String> = names.take(12).collect();
    if names.is_empty() { "no channel at all".into() } else { format!("channels {}", names.join(", ")) }
}
