//! Last photon maps as the camera sees them: photons, density and radius.

use super::map::Map;
use crate::render::MapView;
use crate::report::Run;
use crate::report::quantity::percent;
use maud::{Markup, html};

/// Section of the photon maps; empty without any.
pub(super) fn section(run: &Run) -> Markup {
    let Some(view) = &run.result.photon_view else { return html! {} };
    let maps = [("photons", &view.global), ("caustic photons", &view.caustic)];
    html! {
        @if view.global.is_some() || view.caustic.is_some() {
            section {
                h2 { "Photons of the last maps" }
                div.maps {
                    @for (name, map) in maps {
                        @if let Some(map) = map { (figures(name, view.width, map)) }
                    }
                }
            }
        }
    }
}

fn figures(name: &str, width: u32, view: &MapView) -> Markup {
    let map = |values: &[f32]| Map { width, values: values.to_vec() };
    let visible = percent(view.seen);
    html! {
        (map(&view.positions).figure(
            &format!("Visible {name}"),
            &format!("Photons per pixel, except behind glass and in mirrors: {visible} of all {name}."),
        ))
        (map(&view.density).figure(
            &format!("Density of {name}"),
            "Photons per square metre of surface, from the nearest 64. Glass and mirrors hold no photons and \
            show the density nearby.",
        ))
        (map(&view.radius).figure(
            &format!("Radius of {name}"),
            "Radius of the nearest 64 in metres: the blur of an estimate from as many photons.",
        ))
    }
}
