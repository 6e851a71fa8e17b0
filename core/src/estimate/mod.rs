//! What is known of the error of a picture.

mod audit;
mod blur;
mod deviation;
mod filter;
mod interval;
mod metric;
mod noise;
mod seen;
mod shrinkage;
mod tile;

pub use audit::{BiasEstimate, Finding};
pub use blur::TileBlur;
pub use deviation::Deviation;
pub use filter::{filtered, filtered_pixel};
pub use interval::ErrorEstimate;
pub use metric::{Difference, mse, relmse, rmse};
pub use noise::{BLOCKS, BlockNoise, Noise};
pub use shrinkage::{Lookalikes, Shrinkage};
pub use tile::{TileError, TileLight};
