//! Error of a picture: metrics against a reference, and estimates without one.

mod audit;
mod density_bias;
mod deviation;
mod empirical_bayes;
mod filter;
mod interval;
mod metric;
mod points;
mod regions;
mod student;
mod tile;
mod tile_statistics;

pub use audit::{BiasEstimate, PixelBias};
pub use density_bias::TileBlur;
pub use deviation::Deviation;
pub use empirical_bayes::{BrightnessClasses, Shrinkage};
pub use filter::{filtered, filtered_pixel};
pub use interval::ErrorEstimate;
pub(crate) use metric::RELMSE_OFFSET;
pub use metric::{Difference, mse, relmse, rmse};
pub use points::{POOLED_POINTS, half_width, point_variances};
pub use regions::ErrorSums;
pub use student::{NORMAL_95, student_quantile};
pub use tile::{TileError, TileLight};
