//! What is known of the error of a picture.

mod metric;

pub use metric::{Difference, mse, relmse, rmse};
