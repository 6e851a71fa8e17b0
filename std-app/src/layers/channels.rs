//! Channels of the layers of a picture.

use super::cryptomatte;
use crate::load::LoadedScene;
use crate::render::{Layer, Layers, RenderResult};
use crate::save::{Attribute, ExrFile, Image};
use halflight_core::reconstruction::{Coverage, NO_ID, PixelLayers, RANKS};

/// Values of layers.
#[derive(Clone, Copy)]
pub struct LayerSource<'r> {
    /// Variance of the pixels of the picture.
    pub variance: &'r Image,
    /// Samples of each pixel.
    pub samples: &'r [u32],
    /// Surfaces and halves.
    pub layers: &'r Layers,
    /// The scene, with its names and its transform; without it there are no depth, position, materials and
    /// objects.
    pub scene: Option<&'r LoadedScene>,
}

impl<'r> LayerSource<'r> {
    /// The values of `result`, a picture of `scene`.
    pub fn new(result: &'r RenderResult, scene: &'r LoadedScene) -> Self {
        let RenderResult { variance, samples, layers, .. } = result;
        Self { variance, samples, layers, scene: Some(scene) }
    }
}

const RGB: [char; 3] = ['R', 'G', 'B'];
const XYZ: [char; 3] = ['X', 'Y', 'Z'];

/// Adds `wanted` layers to a file. Layers whose values are missing are left out.
pub fn add_layers<'r>(file: &mut ExrFile<'r>, wanted: &[Layer], of: &LayerSource<'r>) {
    let LayerSource { variance, samples, layers, scene } = *of;
    for layer in wanted {
        match layer {
            Layer::Error => file.add_channels("error", RGB, |at| variance.pixels[at].map(f32::sqrt)),
            Layer::Samples => file.add_channel("samples.X", |at| samples[at] as f32),
            Layer::Halves => {
                for (name, half) in ["even", "odd"].into_iter().zip(layers.halves.iter().flatten()) {
                    file.add_channels(name, RGB, |at| half.pixels[at]);
                }
            }
            _ if layers.surfaces.is_empty() => {}
            Layer::Albedo => file.add_channels("albedo", RGB, |at| layers.surfaces[at].albedo),
            Layer::Normal => file.add_channels("normal", XYZ, |at| layers.surfaces[at].normal),
            Layer::Depth | Layer::Position | Layer::Material | Layer::Object => {
                if let Some(scene) = scene {
                    add_layer_of_scene(file, *layer, &layers.surfaces, scene);
                }
            }
        }
    }
}

/// Adds a layer whose values are in the coordinates or by the names of `scene`.
fn add_layer_of_scene<'r>(
    file: &mut ExrFile<'r>,
    layer: Layer,
    surfaces: &'r [PixelLayers],
    scene: &'r LoadedScene,
) {
    match layer {
        Layer::Depth => {
            let unit = 1.0 / scene.transform.length(1.0);
            file.add_channel("depth.Z", move |at| (f64::from(surfaces[at].depth) * unit) as f32);
        }
        Layer::Position => file.add_channels("position", XYZ, |at| match surfaces[at].depth {
            0.0 => [0.0; 3],
            _ => scene.transform.to_user(surfaces[at].position.into()).map(|x| x as f32),
        }),
        Layer::Material => {
            add_numbers(file, ("material", "materials"), &scene.material_names, |at| surfaces[at].materials);
            cryptomatte::add(file, "CryptoMaterial", &scene.material_names, |at| surfaces[at].materials);
        }
        _ => {
            add_numbers(file, ("object", "objects"), &scene.object_names, |at| surfaces[at].objects);
            cryptomatte::add(file, "CryptoObject", &scene.object_names, |at| surfaces[at].objects);
        }
    }
}

/// Adds the number of the most frequent material or object, from 0, -1 for none, and an attribute with the
/// list of all names.
fn add_numbers<'r>(
    file: &mut ExrFile<'r>,
    (layer, attribute): (&str, &str),
    names: &[String],
    coverage: impl Fn(usize) -> [Coverage; RANKS] + Sync + 'r,
) {
    file.add_channel(format!("{layer}.X"), move |at| match coverage(at)[0].id {
        NO_ID => -1.0,
        id => id as f32,
    });
    file.set(attribute, Attribute::Text(serde_json::Value::from(names).to_string()));
}
