//! Files of probes: JSON for three.js, a table, and KTX2 with an ambient cube for Bevy.

use super::ktx2;
use super::probes::{AXES, Probe, ProbeGrid};
use core::f32::consts::FRAC_1_PI;
use halflight_core::Rgb;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::Path;

/// Format of probes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProbeFormat {
    /// Spherical harmonics in the order of three.js, with half-widths.
    Json,
    /// A line for each probe.
    Csv,
    /// The texture of an irradiance volume of Bevy.
    Ktx2,
}

impl ProbeFormat {
    /// Format by the extension of a file.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "json" => Some(Self::Json),
            "csv" => Some(Self::Csv),
            "ktx2" => Some(Self::Ktx2),
            _ => None,
        }
    }
}

/// Functions whose coefficients a probe has.
const BASIS: [&str; 9] = ["1", "y", "z", "x", "xy", "yz", "3z2-1", "xz", "x2-y2"];

/// Writes the `probes` of `grid`.
///
/// # Errors
/// Those of `out`.
pub fn write_probes(
    out: &mut dyn Write,
    format: ProbeFormat,
    grid: &ProbeGrid,
    probes: &[Probe],
) -> io::Result<()> {
    match format {
        ProbeFormat::Json => writeln!(out, "{}", object(grid, probes)),
        ProbeFormat::Csv => table(out, grid, probes),
        ProbeFormat::Ktx2 => ktx2::write_volume(out, volume_size(grid), &volume(grid, probes)),
    }
}

fn object(grid: &ProbeGrid, probes: &[Probe]) -> Value {
    let [min, max] = grid.bounds();
    let colours = |probe: &Probe| probe.coefficients.map(|colour| colour.to_array());
    json!({
        "size": grid.size(),
        "box": { "min": min, "max": max },
        "basis": BASIS,
        "coefficients": probes.iter().map(colours).collect::<Vec<_>>(),
        "half_width": probes.iter().map(|probe| probe.half_widths).collect::<Vec<_>>(),
        "back_faces": probes.iter().map(|probe| probe.back_faces).collect::<Vec<_>>(),
        "valid": probes.iter().map(|probe| probe.is_valid).collect::<Vec<_>>(),
    })
}

fn table(out: &mut dyn Write, grid: &ProbeGrid, probes: &[Probe]) -> io::Result<()> {
    write!(out, "x,y,z,back_faces,valid")?;
    for name in BASIS {
        write!(out, ",r {name},g {name},b {name},half_width {name}")?;
    }
    writeln!(out)?;
    for (cell, probe) in probes.iter().enumerate() {
        let [x, y, z] = grid.position(cell);
        write!(out, "{x},{y},{z},{},{}", probe.back_faces, u8::from(probe.is_valid))?;
        for (Rgb { x, y, z }, half_width) in probe.coefficients.into_iter().zip(probe.half_widths) {
            write!(out, ",{x},{y},{z},{half_width}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Size of the texture of an irradiance volume: along y the sides of negative normals follow those of
/// positive ones, and along z the axes follow each other.
fn volume_size(grid: &ProbeGrid) -> [usize; 3] {
    let [width, height, depth] = grid.size();
    [width, 2 * height, 3 * depth]
}

/// Radiances of white diffuse surfaces with the normals of an ambient cube, irradiance / π.
fn volume(grid: &ProbeGrid, probes: &[Probe]) -> Vec<Rgb> {
    let ([width, height, depth], [across, down, _]) = (grid.size(), volume_size(grid));
    let mut texels = vec![Rgb::ZERO; probes.len() * AXES.len()];
    for (cell, probe) in probes.iter().enumerate() {
        let [x, y, z] = [cell % width, cell / width % height, cell / (width * height)];
        for (side, irradiance) in probe.cube.into_iter().enumerate() {
            let (axis, sign) = (side / 2, side % 2);
            let place = x + across * (y + sign * height + down * (z + axis * depth));
            texels[place] = irradiance * FRAC_1_PI;
        }
    }
    texels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::ProbeSettings;
    use crate::load::{LoadOptions, PartMesh, SceneParts};
    use crate::memory::Budget;
    use halflight_core::glam::Vec3;
    use halflight_core::scene::Material;

    /// A texel as the shader of Bevy (0.16, `irradiance_volume.wgsl`) finds it, for a position from 0 to 1.
    fn fetched(texels: &[Rgb], grid: &ProbeGrid, position: Vec3, axis: usize, is_negative: bool) -> Rgb {
        let [width, height, depth] = volume_size(grid).map(|side| side as f32);
        let atlas = Vec3::new(width, height, depth);
        let resolution = atlas / Vec3::new(1.0, 2.0, 3.0);
        let stp = (position * resolution).clamp(Vec3::splat(0.5), resolution - 0.5);
        let negative = if is_negative { 0.5 } else { 0.0 };
        let uvw = stp / atlas + Vec3::new(0.0, negative, axis as f32 / 3.0);
        let [x, y, z] = (uvw * atlas).to_array().map(|at| at as usize);
        texels[x + width as usize * (y + height as usize * z)]
    }

    #[test]
    fn every_side_of_a_volume_is_found_by_its_reader() {
        let mut parts = SceneParts::new(LoadOptions::default());
        let grey = parts.material("grey", Material::diffuse(Rgb::splat(0.5)));
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
        let mesh = PartMesh { positions: &positions, triangles: &[[0, 1, 2]], ..PartMesh::default() };
        parts.mesh("triangle", &mesh, grey).unwrap();
        let settings = ProbeSettings { size: [3, 2, 4], bounds: None, cubes: true };
        let grid = ProbeGrid::new(&parts.build().unwrap(), settings, &mut Budget::new(None)).unwrap();
        let side = |cell: usize, side: usize| Rgb::new(cell as f32, side as f32, 1.0);
        let probe = |cell| Probe { cube: core::array::from_fn(|i| side(cell, i)), ..Probe::default() };
        let texels = volume(&grid, &(0..24).map(probe).collect::<Vec<_>>());
        for cell in 0..24 {
            let place = Vec3::new((cell % 3) as f32, (cell / 3 % 2) as f32, (cell / 6) as f32);
            let position = (place + 0.5) / Vec3::new(3.0, 2.0, 4.0);
            for (number, axis) in AXES.into_iter().enumerate() {
                let is_negative = axis.element_sum() < 0.0;
                let found = fetched(&texels, &grid, position, number / 2, is_negative);
                assert!(found.distance(side(cell, number) * FRAC_1_PI) < 1e-5, "{cell} {axis}");
            }
        }
    }
}
