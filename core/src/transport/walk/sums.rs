//! Running sums of MIS weights that a subpath carries (Georgiev et al. 2012); `bidirectional/mis.rs` updates
//! them.

use bytemuck::{Pod, Zeroable};

/// The running sums of one subpath.
///
/// | | `last` | `rest` | `pending_merge` |
/// |---|---|---|---|
/// | Georgiev's and SmallVCM's | dVCM | dVC = η dVM | the term η of one vertex in dVC |
/// | techniques | connects over the latest segment | all before it | merge at the latest rough vertex |
/// | lacks the factor | 1 | p← | p←, and 1 at the vertex of the merge |
/// | [`Sums::at_light`] | n p_light / (e c) | 1 / (e c), or 0 for delta lights | 0 |
/// | [`Sums::at_camera`] | L / q | 0 | 0 |
/// | [`Sums::arrive`] | · d² / c, or 0 at a delta vertex | / c | / c |
/// | [`Sums::scatter`] | n_C / p | c / p (last + rest p←) | c / p · pending p←, or c η / p if rough |
/// | [`Sums::scatter_delta`] | 0 | · c / n² | · c / n² |
///
/// SmallVCM merges at every vertex, so its dVC has a term η for each. Its densities of emission per area are
/// per étendue here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sums {
    /// Technique that connects over the latest segment.
    pub last: f32,
    /// Techniques before it.
    pub rest: f32,
    /// Merge at the latest rough vertex, which the next vertex may make void.
    pub pending_merge: f32,
}
