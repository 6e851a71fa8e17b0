//! Layers of a picture: their names, and the search of surfaces that fills those of surfaces.

use super::RenderError;
use super::memory::Memory;
use super::setup::RenderSetup;
use super::threads::Threads;
use super::window::values_in_window;
use crate::save::Image;
use halflight_core::bsdf::Features;
use halflight_core::memory::{Arena, Footprint};
use halflight_core::reconstruction::{FirstSurfaces, PixelLayers, RANKS, SurfaceComponents};

/// A layer beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Albedo behind smooth mirrors and glass.
    Albedo,
    /// Shading normal behind smooth mirrors and glass.
    Normal,
    /// Distance of the first surface from the camera.
    Depth,
    /// Position of the first surface.
    Position,
    /// Material of the first surface, and its Cryptomatte.
    Material,
    /// Object of the first surface, and its Cryptomatte.
    Object,
    /// Standard deviation of the pixels of the picture.
    Error,
    /// Number of samples.
    Samples,
    /// Means of the even and of the odd samples.
    Halves,
}

impl Layer {
    /// All layers, in the order of help texts.
    pub const ALL: [Self; 9] = [
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Position,
        Self::Material,
        Self::Object,
        Self::Error,
        Self::Samples,
        Self::Halves,
    ];

    /// Name in `--aov`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Material => "material",
            Self::Object => "object",
            Self::Error => "error",
            Self::Samples => "samples",
            Self::Halves => "halves",
        }
    }

    /// The layer of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layer| layer.name() == name)
    }

    /// Number of its channels in a file.
    const fn channels(self) -> u32 {
        match self {
            Self::Albedo | Self::Normal | Self::Position | Self::Error => 3,
            Self::Depth | Self::Samples => 1,
            Self::Material | Self::Object => 1 + 2 * RANKS as u32,
            Self::Halves => 6,
        }
    }

    /// True if the surfaces of the scene determine it, and no samples.
    pub const fn is_of_surfaces(self) -> bool {
        !matches!(self, Self::Error | Self::Samples | Self::Halves)
    }

    /// True if a film determines it, without its scene: of surfaces, only a film that keeps them.
    pub const fn is_in_films(self) -> bool {
        !matches!(self, Self::Depth | Self::Position | Self::Material | Self::Object)
    }
}

/// Layers that a render makes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerSettings {
    /// The layers.
    pub layers: Vec<Layer>,
    /// Object of each triangle; empty without [`Layer::Object`].
    pub objects: Vec<u32>,
}

impl LayerSettings {
    /// These layers of a scene whose triangles belong to these `objects`.
    pub fn new(layers: &[Layer], objects: &[u32]) -> Self {
        let objects = if layers.contains(&Layer::Object) { objects } else { &[] };
        Self { layers: layers.to_vec(), objects: objects.to_vec() }
    }

    /// Number of their channels in a file.
    pub(super) fn channels(&self) -> u32 {
        self.layers.iter().map(|layer| layer.channels()).sum()
    }

    /// True if `layer` is wanted.
    pub fn has(&self, layer: Layer) -> bool {
        self.layers.contains(&layer)
    }
}

/// Values of layers that are not in the other fields of a result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Surfaces of each pixel, row by row, in the coordinates of the core; empty if no layer of surfaces is
    /// wanted, or if the render ended before they were found.
    pub surfaces: Vec<PixelLayers>,
    /// Means of the even and of the odd samples, if wanted.
    pub halves: Option<[Image; 2]>,
}

/// Bytes of the layers of `settings` besides those of a plain picture.
pub(super) fn footprint(settings: &LayerSettings, pixels: usize) -> Footprint {
    let has_surfaces = settings.layers.iter().any(|layer| layer.is_of_surfaces());
    let halves = if settings.has(Layer::Halves) { 2 * pixels } else { 0 };
    Footprint::default()
        .slice::<PixelLayers>(if has_surfaces { pixels } else { 0 })
        .slice::<[f32; 3]>(halves)
        .slice::<u32>(settings.objects.len())
}

/// Surfaces of the view for its layers; none also at the end of the time.
pub(super) fn surfaces<F: Features>(
    setup: &RenderSetup,
    memory: &mut Memory,
) -> Result<Vec<PixelLayers>, RenderError> {
    const RAYS: &str = "rays of layers";
    let RenderSetup { settings, workers, .. } = *setup;
    let Some(wanted) = &settings.layers else { return Ok(Vec::new()) };
    let pixels = settings.width as usize * settings.height as usize;
    memory.set_aside("layers", footprint(wanted, pixels))?;
    if !wanted.layers.iter().any(|layer| layer.is_of_surfaces()) {
        return Ok(Vec::new());
    }
    let mut scratch = memory.take_each(RAYS, FirstSurfaces::<F>::scratch(), workers.count())?;
    let mut executor = Threads::new(workers, &mut scratch);
    let mut surfaces = vec![PixelLayers::default(); pixels];
    let search = FirstSurfaces::<F>::new(&setup.context(), SurfaceComponents::default());
    let mut lines =
        memory.take(RAYS, FirstSurfaces::<F>::layers_footprint(settings.width, settings.height))?;
    let mut arena = Arena::over(&mut lines);
    let is_complete = search.layers(&wanted.objects, &mut surfaces, &mut arena, &mut executor)?;
    memory.give_back(RAYS);
    Ok(if is_complete { values_in_window(surfaces, settings.width, settings.shard) } else { Vec::new() })
}
