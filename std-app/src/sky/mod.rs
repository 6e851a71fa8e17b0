//! Clear skies with a sun, as environments of scene files: the position of the sun by place and time
//! ([`position`]), the light of the sky (Hosek and Wilkie 2012) and of the sun (Preetham et al. 1999).
//!
//! The unit of all light is W/m² (sr) per channel of linear sRGB, 179 lm/W as of `bake --unit lux`.

mod dome;
mod map;
pub mod position;
mod sun;

pub use dome::{Dome, SkyError};
pub use map::{BYTES as MAP_BYTES, SIZE as MAP_SIZE, map};
pub use sun::{RADIUS_DEGREES, irradiance};

/// Photometric luminous efficacy (683 lm/W) over that of a W/m² of the picture (179 lm/W, Ward 1994).
const UNITS: f64 = 683.0 / 179.0;
