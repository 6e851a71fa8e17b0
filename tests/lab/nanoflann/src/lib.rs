//! nanoflann's kd-tree behind a safe interface: build, the k nearest, all within a radius.
#![cfg(feature = "shim")]

use core::ffi::c_void;
use core::marker::PhantomData;
use core::ptr::NonNull;

unsafe extern "C" {
    fn halflight_nanoflann_build(points: *const [f32; 3], count: usize) -> *mut c_void;
    fn halflight_nanoflann_free(tree: *mut c_void);
    fn halflight_nanoflann_nearest(
        tree: *mut c_void,
        place: *const f32,
        k: usize,
        squared_radius: f32,
    ) -> usize;
    fn halflight_nanoflann_within(tree: *mut c_void, place: *const f32, squared_radius: f32) -> usize;
}

/// A tree over points that it borrows, with the working memory of its searches.
#[derive(Debug)]
pub struct Tree<'p> {
    tree: NonNull<c_void>,
    points: PhantomData<&'p [[f32; 3]]>,
}

impl<'p> Tree<'p> {
    /// Over `points`. `None` where there is none.
    pub fn new(points: &'p [[f32; 3]]) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        // SAFETY: the shim reads `points.len()` points from there, now and as long as the tree is kept, which
        // is no longer than they are borrowed.
        let tree = unsafe { halflight_nanoflann_build(points.as_ptr(), points.len()) };
        NonNull::new(tree).map(|tree| Self { tree, points: PhantomData })
    }

    /// Finds the `k` nearest points of `place` with a squared distance below `squared_radius`: how many there
    /// are.
    pub fn nearest(&mut self, place: [f32; 3], k: usize, squared_radius: f32) -> usize {
        if k == 0 {
            return 0;
        }
        // SAFETY: the tree is one that was built; the shim reads three floats.
        unsafe { halflight_nanoflann_nearest(self.tree.as_ptr(), place.as_ptr(), k, squared_radius) }
    }

    /// Finds all points of a squared distance below `squared_radius`: how many there are.
    pub fn within(&mut self, place: [f32; 3], squared_radius: f32) -> usize {
        // SAFETY: as above.
        unsafe { halflight_nanoflann_within(self.tree.as_ptr(), place.as_ptr(), squared_radius) }
    }
}

impl Drop for Tree<'_> {
    fn drop(&mut self) {
        // SAFETY: it was built, and is freed once.
        unsafe { halflight_nanoflann_free(self.tree.as_ptr()) }
    }
}

#[cfg(test)]
mod tests {
    use super::Tree;

    #[test]
    fn points_of_a_line_are_found() {
        let points: Vec<[f32; 3]> = (0..1000).map(|i| [i as f32, 0.0, 0.0]).collect();
        let mut tree = Tree::new(&points).unwrap();
        assert_eq!(tree.nearest([500.2, 0.0, 0.0], 8, f32::INFINITY), 8);
        assert_eq!(tree.nearest([500.2, 0.0, 0.0], 8, 2.0), 3);
        assert_eq!(tree.within([500.2, 0.0, 0.0], 6.5), 5);
        assert!(Tree::new(&[]).is_none());
    }
}
