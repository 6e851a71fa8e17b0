//! Eigen decomposition of symmetric matrices of two and three rows, one at a time and in batches.
//!
//! ```
//! use halflight_core::parts::eigen::symmetric2;
//!
//! // Entries xx, xy, yy of the Hessian of x² + 3 y².
//! let eigen = symmetric2(|value: f32| value, [2.0, 0.0, 6.0]);
//! assert_eq!(eigen.values, [6.0, 2.0]);
//! ```

pub use halflight_simd::kernels::eigen::{
    Decomposed2, Decomposed3, Eigen2, Eigen3, Matrices2, Matrices3, decompose2, decompose3, symmetric2,
    symmetric3,
};
