//! Flags of layers: `--aov`, and the OpenEXR files that have them.

use super::failure::Failure;
use super::print_note;
use clap::Args;
use clap::builder::PossibleValuesParser;
use halflight::layers::{LayerSource, add_layers};
use halflight::load::LoadedScene;
use halflight::render::{Layer, LayerSettings};
use halflight::save::{ExrFile, Format};
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Args)]
pub(super) struct LayerArgs {
    /// Layers in the OpenEXR files of -o, beside the picture: names with commas, or `all`
    #[arg(long, value_name = "LAYERS", value_delimiter = ',', help_heading = "Results",
        value_parser = PossibleValuesParser::new(Layer::ALL.map(Layer::name).into_iter().chain([ALL])))]
    aov: Vec<String>,
}

/// Value for all layers.
const ALL: &str = "all";

impl LayerArgs {
    /// The layers, each once, in their usual order.
    fn layers(&self) -> Vec<Layer> {
        let is_wanted = |layer: &Layer| self.aov.iter().any(|name| name == ALL || name == layer.name());
        Layer::ALL.into_iter().filter(is_wanted).collect()
    }

    /// True if layers are wanted.
    pub(super) fn is_given(&self) -> bool {
        !self.aov.is_empty()
    }

    /// Refuses layers that no file can have.
    pub(super) fn check(&self, pictures: &[PathBuf]) -> Result<(), Failure> {
        let is_exr = |picture: &PathBuf| Format::of(picture).is_ok_and(|format| format == Format::Exr);
        if self.aov.is_empty() || pictures.iter().any(is_exr) {
            return Ok(());
        }
        let message = format!("--aov {}: layers need an OpenEXR file", self.aov.join(","));
        Err(Failure::new(message).advice("add -o NAME.exr"))
    }

    /// Layers of a merged picture.
    ///
    /// # Errors
    /// Layers that need the scene.
    pub(super) fn of_films(&self) -> Result<Vec<Layer>, Failure> {
        let is_all = self.aov.iter().any(|name| name == ALL);
        let layers = self.layers();
        match layers.iter().find(|layer| !layer.is_in_films()) {
            Some(layer) if !is_all => {
                let name = layer.name();
                let message = format!("--aov {name}: films have no {name}, which needs the scene");
                let advice = format!(
                    "render it beside: halflight render SCENE --aov {name} --spp 1 -o layers.exr, with the flags \
                     of the view"
                );
                Err(Failure::new(message).advice(advice))
            }
            _ => Ok(layers.into_iter().filter(|layer| layer.is_in_films()).collect()),
        }
    }

    /// Settings of a render of `loaded`.
    pub(super) fn settings(&self, loaded: &LoadedScene) -> Option<Arc<LayerSettings>> {
        let layers = self.layers();
        (!layers.is_empty()).then(|| Arc::new(LayerSettings::new(&layers, &loaded.triangle_objects)))
    }

    /// Adds the layers to a file.
    pub(super) fn add_to<'r>(&self, file: &mut ExrFile<'r>, of: &LayerSource<'r>) {
        add_layers(file, &self.layers(), of);
    }

    /// Notes that layers of surfaces are missing.
    pub(super) fn note_missing(&self, of: &LayerSource) {
        let surfaces = self.layers().into_iter().filter(|layer| layer.is_of_surfaces());
        let names: Vec<&str> = surfaces.filter(|layer| is_missing(*layer, of)).map(Layer::name).collect();
        if !names.is_empty() {
            let why = match of.scene {
                Some(_) => "the render ended before they were found",
                None => {
                    "films keep albedo and normal alone, and those where the picture may be reconstructed"
                }
            };
            print_note(format!("layers left out: {}: {why}", names.join(", ")));
        }
    }
}

fn is_missing(layer: Layer, of: &LayerSource) -> bool {
    of.layers.surfaces.is_empty() || of.scene.is_none() && !layer.is_in_films()
}
