//! Contents of a scene as named counts.

use halflight_core::census::{Census, EnvironmentKind};
use halflight_core::scene::Scene;

/// Names and counts in the order of reports. Names are JSON keys in snake case.
pub fn counts(census: &Census, scene: &Scene) -> Vec<(&'static str, u64)> {
    let kinds = &census.surfaces;
    vec![
        ("vertices", (scene.mesh.positions.len() + scene.mesh.instances.positions.len()) as u64),
        ("triangles", census.triangles),
        ("unique_triangles", if census.instances > 0 { census.unique_triangles } else { 0 }),
        ("instances", census.instances),
        ("degenerate", census.degenerate),
        ("materials", census.materials),
        ("textures", census.textures),
        ("diffuse", kinds.diffuse),
        ("mirror", kinds.mirror),
        ("pane", kinds.pane),
        ("conductor", kinds.conductor),
        ("glossy", kinds.glossy),
        ("dielectric", kinds.dielectric),
        ("rough_dielectric", kinds.rough_dielectric),
        ("textured", census.textured),
        ("normal_mapped", census.normal_mapped),
        ("cutout", census.cutout),
        ("specular", census.specular),
        ("emissive", census.emissive),
        ("emitters_facing_nothing", census.emitters_facing_nothing),
        ("point_lights", census.point_lights),
        ("spot_lights", census.spot_lights),
        ("directional_lights", census.directional_lights),
        ("environment", u64::from(census.environment != EnvironmentKind::None)),
    ]
}
