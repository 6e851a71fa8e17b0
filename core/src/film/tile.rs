//! How a picture is cut into tiles, and the order of the pixels within one: the Z-curve, so that any run of
//! pixels is a compact patch and its camera rays are alike.

/// Pixels along the side of a tile.
pub const TILE: u32 = 16;

/// Pixels of a tile.
pub const PIXELS_PER_TILE: usize = (TILE * TILE) as usize;

/// One tile of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    left: u32,
    top: u32,
    width: u32,
    height: u32,
}

impl Tile {
    /// Tiles of a picture, those that are cut by its border included.
    pub const fn count(width: u32, height: u32) -> usize {
        width.div_ceil(TILE) as usize * height.div_ceil(TILE) as usize
    }

    /// Tile `index` of a picture, row by row from the upper left.
    pub const fn new(width: u32, height: u32, index: usize) -> Self {
        let across = if width == 0 { 1 } else { width.div_ceil(TILE) as usize };
        Self { left: (index % across) as u32 * TILE, top: (index / across) as u32 * TILE, width, height }
    }

    /// Column and row of its first pixel.
    #[inline]
    pub const fn corner(&self) -> [u32; 2] {
        [self.left, self.top]
    }

    /// Column and row of the `i`th pixel, counted from the upper left of its tile.
    #[inline]
    pub const fn place(i: usize) -> (u32, u32) {
        (even_bits(i as u32), even_bits(i as u32 >> 1))
    }

    /// Column and row of the `i`th pixel of the tile; `None` outside of the picture.
    #[inline]
    pub const fn pixel(&self, i: usize) -> Option<(u32, u32)> {
        let (x, y) = Self::place(i);
        let (x, y) = (self.left + x, self.top + y);
        if x < self.width && y < self.height { Some((x, y)) } else { None }
    }

    /// Where the film keeps the pixel in column `x` and row `y`.
    #[inline]
    pub const fn position(width: u32, x: u32, y: u32) -> usize {
        let tile = (y / TILE) as usize * width.div_ceil(TILE) as usize + (x / TILE) as usize;
        tile * PIXELS_PER_TILE + (spread(x % TILE) | spread(y % TILE) << 1) as usize
    }
}

/// Bits 0, 2, 4, 6 of `i`, moved together.
#[inline]
const fn even_bits(i: u32) -> u32 {
    let i = i & 0x55;
    let i = (i | i >> 1) & 0x33;
    (i | i >> 2) & 0x0f
}

/// The inverse of [`even_bits`].
#[inline]
const fn spread(x: u32) -> u32 {
    let x = (x | x << 2) & 0x33;
    (x | x << 1) & 0x55
}

/// Some pixels of a tile, a bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelSet([u64; PIXELS_PER_TILE / 64]);

impl PixelSet {
    /// Whether the `i`th pixel of the tile is one of them.
    #[inline]
    pub fn contains(&self, i: usize) -> bool {
        self.0.get(i / 64).is_some_and(|word| word >> (i % 64) & 1 == 1)
    }

    /// Adds the `i`th pixel of the tile.
    pub fn insert(&mut self, i: usize) {
        if let Some(word) = self.0.get_mut(i / 64) {
            *word |= 1 << (i % 64);
        }
    }

    /// How many there are.
    pub fn len(&self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
