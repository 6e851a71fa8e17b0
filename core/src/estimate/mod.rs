//! What is known of the error of a picture.

mod filter;
mod interval;
mod metric;
mod tile;

pub use interval::ErrorEstimate;
pub use metric::{Difference, mse, relmse, rmse};
pub use tile::{TileError, TileLight};
