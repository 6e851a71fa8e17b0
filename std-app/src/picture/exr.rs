//! OpenEXR: half, float or integer channels, any compression of the `exr` crate, scanlines or tiles, several
//! parts, any data window. Only blocks of the chosen part are decompressed.

use super::layers::{self, Choice};
use super::primaries::{Primaries, converted};
use super::{FileError, Info, Kind, Picture, Samples, black, fail, pixels};
use exr::block::UncompressedBlock;
use exr::block::reader::{ChunksReader, Reader};
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::f16;
use glam::DMat3;
use std::io::Cursor;

/// Most channels of a part.
const MOST_CHANNELS: usize = 1024;

/// Most samples of a picture that one thread reads faster than several.
const SINGLE_THREAD: usize = 1 << 20;

/// Bytes of a block during decompression over its own: compressed, unpacked, ordered, returned.
const COPIES: usize = 5;

/// A file whose header is read, and the chosen channels.
struct File<'a> {
    reader: Reader<Cursor<&'a [u8]>>,
    choice: Choice,
    /// Size of the display window.
    width: usize,
    height: usize,
    /// Matrix of the colours to sRGB; `None` if they are of sRGB.
    matrix: Option<DMat3>,
    notes: Vec<String>,
}

pub(super) fn info(bytes: &[u8]) -> Result<Info, FileError> {
    let file = open(bytes)?;
    let header = file.header();
    let of_pixel = size_of::<[f32; 3]>() + if file.choice.alpha.is_some() { size_of::<f32>() } else { 0 };
    let kept = file.width * file.height * of_pixel;
    // The header may state tiles larger than the picture.
    let (Vec2(columns, rows), Vec2(width, height)) = (header.max_block_pixel_size(), header.layer_size);
    let block = columns.min(width).saturating_mul(rows.min(height));
    let block = block.saturating_mul(header.channels.bytes_per_pixel);
    // The table of block offsets is not longer than the file.
    let scratch = block.saturating_mul(COPIES * file.blocks_at_once()).saturating_add(2 * bytes.len());
    let (width, height) = (file.width as u32, file.height as u32);
    Ok(Info { kind: Kind::Exr, width, height, kept, peak: kept.saturating_add(scratch) })
}

pub(super) fn decode(bytes: &[u8]) -> Result<Picture, FileError> {
    let file = open(bytes)?;
    let (width, height, has_alpha) = (file.width, file.height, file.choice.alpha.is_some());
    // The picture is black and transparent outside the data window.
    let (mut rgb, mut alpha) = black(width * height, has_alpha)?;
    let wanted = file.columns();
    let origin = file.origin();
    let in_parallel = file.blocks_at_once() > 1;
    let File { reader, choice, matrix, notes, .. } = file;

    let insert = |header: &Header, block: UncompressedBlock| {
        let Vec2(columns, rows) = block.index.pixel_size;
        let line = header.channels.bytes_per_pixel * columns;
        for (row, line) in block.data.chunks_exact(line.max(1)).enumerate().take(rows) {
            let y = origin[1] + (block.index.pixel_position.y() + row) as i64;
            let Some(y) = usize::try_from(y).ok().filter(|y| *y < height) else { continue };
            for column in 0..columns {
                let x = origin[0] + (block.index.pixel_position.x() + column) as i64;
                let Some(x) = usize::try_from(x).ok().filter(|x| *x < width) else { continue };
                let value = |channel: Column| channel.value(line, columns, column);
                let colour = wanted.colour.map(value);
                rgb[y * width + x] = matrix.map_or(colour, |matrix| converted(&matrix, colour));
                if let Some(channel) = wanted.alpha {
                    alpha[y * width + x] = value(channel);
                }
            }
        }
    };
    read_blocks(reader, choice.part, in_parallel, insert)?;
    let samples = Samples::Floats { rgb, alpha };
    Ok(Picture { width: width as u32, height: height as u32, samples, has_alpha, notes })
}

/// Calls `insert` with each block of a part, in any order.
fn read_blocks(
    reader: Reader<Cursor<&[u8]>>,
    part: usize,
    in_parallel: bool,
    mut insert: impl FnMut(&Header, UncompressedBlock),
) -> Result<(), FileError> {
    let is_wanted = |layer: usize, level: Vec2<usize>| layer == part && level == Vec2(0, 0);
    let chunks = reader
        .filter_chunks(false, |_, tile, block| is_wanted(block.layer, tile.level_index))
        .map_err(refused)?;
    let insert = |meta: &exr::meta::MetaData, block: UncompressedBlock| {
        // The table and the blocks of a file may disagree.
        if is_wanted(block.index.layer, block.index.level) {
            insert(&meta.headers[block.index.layer], block);
        }
        Ok(())
    };
    let read = match in_parallel {
        true => chunks.decompress_parallel(false, insert),
        false => chunks.decompress_sequential(false, insert),
    };
    read.map_err(refused)
}

fn open(bytes: &[u8]) -> Result<File<'_>, FileError> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(refused)?;
    let headers = reader.headers();
    let names = |header: &Header| header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let parts: Vec<Vec<String>> = headers.iter().map(names).collect();
    let Some((choice, layer)) = layers::choose(&parts) else {
        let all: Vec<&str> = parts.iter().flatten().take(12).map(String::as_str).collect();
        fail!("no R, G, B and no Y among its channels: {}", all.join(", "));
    };
    check(&headers[choice.part])?;
    let display = headers[choice.part].shared_attributes.display_window.size;
    let (width, height) = (display.x(), display.y());
    pixels(width, height)?;
    let mut notes: Vec<String> =
        layer.map(|layer| format!("its layer `{layer}` is read")).into_iter().collect();
    let [r, g, b] = choice.colour;
    let is_grey = r == g && g == b;
    let matrix = if is_grey { None } else { matrix(&headers[choice.part], &mut notes) };
    Ok(File { reader, choice, width, height, matrix, notes })
}

/// Matrix of the colours of a part to sRGB, by its chromaticities; `None` if they are of sRGB.
fn matrix(header: &Header, notes: &mut Vec<String>) -> Option<DMat3> {
    let given = header.shared_attributes.chromaticities?;
    let given = [given.red, given.green, given.blue, given.white].map(|Vec2(x, y)| [x, y].map(f64::from));
    let (matrix, what) = match Primaries::of(given.as_flattened()) {
        Primaries::Srgb => return None,
        Primaries::Other(matrix) => (Some(matrix), "are converted to sRGB"),
        Primaries::Invalid => (None, "are taken as those of sRGB: these are no primaries"),
    };
    let numbers: Vec<String> = given.as_flattened().iter().map(|x| format!("{:.4}", x)).collect();
    notes.push(format!("its colours of chromaticities {} {what}", numbers.join(" ")));
    matrix
}

/// An error of the decoder.
fn refused(error: exr::error::Error) -> FileError {
    match error {
        exr::error::Error::Invalid(why) => FileError::new(format!("it is damaged or cut off: {why}")),
        other => FileError::new(other),
    }
}

fn check(header: &Header) -> Result<(), FileError> {
    pixels(header.layer_size.x(), header.layer_size.y())?;
    let channels = &header.channels.list;
    if header.deep {
        fail!("deep pictures are not supported");
    }
    if channels.len() > MOST_CHANNELS {
        fail!("more than {MOST_CHANNELS} channels are not supported");
    }
    let is_chroma = |name: String| ["RY", "BY"].contains(&name.as_str());
    if channels.iter().any(|c| c.sampling != Vec2(1, 1) || is_chroma(c.name.to_string())) {
        fail!("luminance with chroma (RY, BY) is not supported");
    }
    Ok(())
}

impl File<'_> {
    /// Header of the chosen part.
    fn header(&self) -> &Header {
        &self.reader.headers()[self.choice.part]
    }

    /// Origin of the data window in the display window.
    fn origin(&self) -> [i64; 2] {
        let header = self.header();
        let (data, display) =
            (header.own_attributes.layer_position, header.shared_attributes.display_window.position);
        [i64::from(data.x()) - i64::from(display.x()), i64::from(data.y()) - i64::from(display.y())]
    }

    /// Blocks that are decompressed at once.
    fn blocks_at_once(&self) -> usize {
        let Vec2(width, height) = self.header().layer_size;
        match width.saturating_mul(height) < SINGLE_THREAD {
            true => 1,
            false => rayon::current_num_threads() + 4,
        }
    }

    /// Positions of the chosen channels in a line of a block.
    fn columns(&self) -> Columns {
        let column = |channel: usize| {
            let channels = &self.header().channels.list;
            let before = channels[..channel].iter().map(|c| c.sample_type.bytes_per_sample()).sum();
            Column { before, kind: channels[channel].sample_type }
        };
        Columns { colour: self.choice.colour.map(column), alpha: self.choice.alpha.map(column) }
    }
}

struct Columns {
    colour: [Column; 3],
    alpha: Option<Column>,
}

/// A channel in a line of a block, which stores its channels one after the other.
#[derive(Clone, Copy)]
struct Column {
    /// Bytes of a pixel in the channels before this one.
    before: usize,
    kind: SampleType,
}

impl Column {
    /// The value at `column` in a line of `columns` pixels.
    fn value(&self, line: &[u8], columns: usize, column: usize) -> f32 {
        let at = self.before * columns + column * self.kind.bytes_per_sample();
        let bytes = &line[at..];
        match self.kind {
            SampleType::F16 => f16::from_ne_bytes([bytes[0], bytes[1]]).to_f32(),
            SampleType::F32 => f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
            SampleType::U32 => u32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32,
        }
    }
}
