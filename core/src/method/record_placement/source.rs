//! Positions of records: at surfaces that the camera sees, or at given points.

use crate::bsdf::Features;
use crate::cache::radiance::ServedLobes;
use crate::transport::cached::gather::GatherPoint;
use crate::transport::cached::placement::{ProgressiveOrder, Via};
use crate::transport::cached::point_places::PointPlaces;
use crate::transport::{Counters, PathIntegrator};

/// Pixels along the side of the square of which one pixel is looked at.
const STRIDE: u32 = 2;

/// Source of the places of records.
#[derive(Clone, Copy)]
pub enum PlaceSource<'p> {
    /// A picture of this width and height.
    Picture([u32; 2]),
    /// Points.
    Points(PointPlaces<'p>),
}

/// A source with its order.
#[derive(Clone, Copy)]
pub(super) enum PlaceOrder<'p> {
    Picture(ProgressiveOrder),
    Points(PointPlaces<'p>),
}

impl<'p> PlaceSource<'p> {
    /// Number of steps of the order.
    pub(super) fn len(&self) -> u64 {
        match self.order() {
            PlaceOrder::Picture(order) => order.len(),
            PlaceOrder::Points(points) => points.len(),
        }
    }

    /// True if places are seen, also by rough surfaces.
    pub(super) fn has_views(&self) -> bool {
        matches!(self, Self::Picture(_))
    }

    pub(super) fn order(&self) -> PlaceOrder<'p> {
        match *self {
            Self::Picture([width, height]) => {
                PlaceOrder::Picture(ProgressiveOrder::new(width, height, STRIDE))
            }
            Self::Points(points) => PlaceOrder::Points(points),
        }
    }
}

impl PlaceOrder<'_> {
    /// Writes the places of the steps from `first` on that are seen in this way to `out`.
    pub(super) fn places<F: Features>(
        &self,
        integrator: &PathIntegrator<F>,
        (first, target): (u64, (u32, Via)),
        lobes: Option<&ServedLobes>,
        out: &mut [GatherPoint],
        counters: &mut Counters,
    ) {
        match self {
            Self::Picture(order) => integrator.places_with(order, first, target, lobes, out, counters),
            Self::Points(points) => points.places(first, out),
        }
    }
}
