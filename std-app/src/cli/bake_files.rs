//! Files of tables, maps and probes, of `halflight bake` and `halflight merge`.

use super::failure::Failure;
use super::interrupt::INTERRUPT;
use super::outputs::{Outputs, Role};
use super::print_note;
use core::fmt;
use core::sync::atomic::Ordering;
use core::time::Duration;
use halflight::bake::{
    BakeSubject, Baked, Lightmap, MergedBake, Probe, ProbeFormat, ProbeGrid, Quantity, Sensor, TableFormat,
    Texel, check_format, write_probes, write_table,
};
use halflight::save::{FileError, Format, Patience};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Numbers of charts and texels, or of probes, for text and JSON.
pub(super) struct Saved {
    text: String,
    entries: Vec<(&'static str, Value)>,
}

impl Saved {
    pub(super) fn add_to(self, object: &mut Value) {
        self.entries.into_iter().for_each(|(key, value)| object[key] = value);
    }
}

impl fmt::Display for Saved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Files of tables.
pub(super) struct TableFiles(Vec<(PathBuf, TableFormat)>);

impl TableFiles {
    pub(super) fn new(paths: &[PathBuf]) -> Result<Self, Failure> {
        formats(paths, TableFormat::of, "a table is .csv, .res or .ply").map(Self)
    }

    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        plan_tables(&self.0, outputs)
    }

    pub(super) fn save(
        &self,
        outputs: &mut Outputs,
        (sensors, baked, quantity): (&[Sensor], &Baked, Quantity),
    ) {
        for (path, format) in &self.0 {
            let columns = (&baked.values[..], &baked.back_faces[..]);
            outputs.save_table(path, |out| write_table(out, (*format, quantity), sensors, columns));
        }
    }
}

fn plan_tables<T>(files: &[(PathBuf, T)], outputs: &mut Outputs) -> Result<(), Failure> {
    files.iter().try_for_each(|(path, _)| outputs.plan(Role::Table, path))
}

fn formats<T>(
    paths: &[PathBuf],
    of: impl Fn(&Path) -> Option<T>,
    endings: &str,
) -> Result<Vec<(PathBuf, T)>, Failure> {
    let format = |path: &PathBuf| match of(path) {
        Some(format) => Ok((path.clone(), format)),
        None => Err(Failure::new(format!("{}: {endings}", path.display()))
            .advice("choose a name with one of these endings")),
    };
    paths.iter().map(format).collect()
}

/// Part of the time limit of a bake that filling and stitching may take after it.
const FILLING: f64 = 0.1;

/// Files of a lightmap.
pub(super) struct MapFiles {
    maps: Vec<(PathBuf, Format)>,
    error_map: Option<(PathBuf, Format)>,
}

impl MapFiles {
    pub(super) fn new(maps: &[PathBuf], error_map: Option<&Path>, is_signed: bool) -> Result<Self, Failure> {
        let maps = maps.iter().map(|path| picture(path, is_signed)).collect::<Result<_, _>>()?;
        Ok(Self { maps, error_map: error_map.map(|path| picture(path, false)).transpose()? })
    }

    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        plan_tables(&self.maps, outputs)?;
        self.error_map.iter().try_for_each(|(path, _)| outputs.plan(Role::ErrorMap, path))
    }

    /// Writes the map of `baked` irradiances. Filling and stitching end some time after a signal, or after
    /// the time limit of the bake.
    pub(super) fn save(
        &self,
        outputs: &mut Outputs,
        (lightmap, baked, quantity): (&Lightmap, &Baked, Quantity),
        limit: Option<f64>,
    ) -> Saved {
        let start = Instant::now();
        let watch = || {
            let is_ended = limit.is_some() || INTERRUPT.load(Ordering::Relaxed);
            !is_ended || start.elapsed() < Patience::LEAST.max(limited(limit))
        };
        let map = lightmap.map(baked, quantity, &watch);
        let unfilled = lightmap.unfilled(&map);
        if unfilled > 0 {
            print_note(format!("{unfilled} texels have no value, since the bake was ended before"));
        }
        let mut save = |path: &Path, bytes: Result<Vec<u8>, FileError>| match bytes {
            Ok(bytes) => outputs.save_table(path, |out| out.write_all(&bytes)),
            Err(error) => outputs.fail(error),
        };
        self.maps.iter().for_each(|(path, format)| save(path, map.encode(*format)));
        self.error_map.iter().for_each(|(path, format)| save(path, map.encode_error(*format)));
        let (charts, computed, filled) =
            (lightmap.charts(), map.count(Texel::Computed), lightmap.filled(&map));
        let padded = map.count(Texel::Filled) - filled;
        let texels = json!({ "computed": computed, "filled": filled, "padded": padded, "open": unfilled });
        Saved {
            text: format!("{charts} charts, {computed} texels computed and {filled} filled; "),
            entries: vec![("charts", charts.into()), ("texels", texels)],
        }
    }
}

/// Time for the texels of a map that have no points, after a bake of so many seconds at most.
fn limited(limit: Option<f64>) -> Duration {
    Duration::try_from_secs_f64(limit.unwrap_or(0.0) * FILLING).unwrap_or(Duration::MAX)
}

/// File and format of a map.
fn picture(path: &Path, is_signed: bool) -> Result<(PathBuf, Format), Failure> {
    let format = Format::of(path)?;
    check_format(format, is_signed).map_err(|error| Failure::new(format!("{}: {error}", path.display())))?;
    Ok((path.to_owned(), format))
}

/// Files of probes.
pub(super) struct ProbeFiles(Vec<(PathBuf, ProbeFormat)>);

impl ProbeFiles {
    pub(super) fn new(paths: &[PathBuf]) -> Result<Self, Failure> {
        formats(paths, ProbeFormat::of, "probes are .json, .csv or .ktx2").map(Self)
    }

    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        plan_tables(&self.0, outputs)
    }

    /// True if a file has ambient cubes.
    pub(super) fn has_cubes(&self) -> bool {
        self.0.iter().any(|(_, format)| *format == ProbeFormat::Ktx2)
    }

    /// Writes the probes of `baked` irradiances.
    pub(super) fn save(&self, outputs: &mut Outputs, (grid, baked): (&ProbeGrid, &Baked)) -> Saved {
        let probes = grid.probes(baked);
        for (path, format) in &self.0 {
            outputs.save_table(path, |out| write_probes(out, *format, grid, &probes));
        }
        let count = probes.len();
        let sampled = grid.sampled(baked);
        let open = sampled.iter().filter(|is_sampled| !**is_sampled).count();
        let is_inside = |(probe, is_sampled): &(&Probe, &bool)| !probe.is_valid && **is_sampled;
        let inside = probes.iter().zip(&sampled).filter(is_inside).count();
        let without = if open > 0 { format!(", {open} without samples") } else { String::new() };
        Saved {
            text: format!("{count} probes, {inside} inside bodies{without}; "),
            entries: vec![("probes", json!({ "count": count, "inside": inside, "open": open }))],
        }
    }
}

/// Files of a merged bake.
pub(super) enum BakeFiles {
    Tables(TableFiles),
    Map(MapFiles),
    Probes(ProbeFiles),
}

impl BakeFiles {
    /// Files of a merge of `subject`.
    ///
    /// # Errors
    /// Files of other formats than those of `subject`.
    pub(super) fn new(
        subject: &BakeSubject,
        (paths, error_map): (&[PathBuf], Option<&Path>),
    ) -> Result<Self, Failure> {
        if let BakeSubject::Lightmap(lightmap) = subject {
            return MapFiles::new(paths, error_map, lightmap.is_signed()).map(Self::Map);
        }
        check_no_error_map(error_map)?;
        let BakeSubject::Probes(grid) = subject else { return TableFiles::new(paths).map(Self::Tables) };
        let files = ProbeFiles::new(paths)?;
        match files.has_cubes() && !grid.has_cubes() {
            true => Err(Failure::new("the bake has no ambient cubes, of which a .ktx2 consists")
                .advice("bake with -o NAME.ktx2, or name a .json or .csv")),
            false => Ok(Self::Probes(files)),
        }
    }

    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        match self {
            Self::Tables(files) => files.plan(outputs),
            Self::Map(files) => files.plan(outputs),
            Self::Probes(files) => files.plan(outputs),
        }
    }

    /// Writes the files of `merged`; a table has no numbers of its own.
    pub(super) fn save(&self, outputs: &mut Outputs, merged: &MergedBake) -> Option<Saved> {
        let MergedBake { baked, subject, quantity } = merged;
        match (self, subject) {
            (Self::Map(files), BakeSubject::Lightmap(lightmap)) => {
                Some(files.save(outputs, (lightmap, baked, *quantity), None))
            }
            (Self::Probes(files), BakeSubject::Probes(grid)) => Some(files.save(outputs, (grid, baked))),
            (Self::Tables(files), BakeSubject::Sensors(sensors)) => {
                files.save(outputs, (sensors, baked, *quantity));
                None
            }
            _ => None,
        }
    }
}

/// Refuses `--error-map` of what is no lightmap.
pub(super) fn check_no_error_map(error_map: Option<&Path>) -> Result<(), Failure> {
    error_map.map_or(Ok(()), |path| {
        Err(Failure::new(format!(
            "{} (--error-map): lightmaps alone have a map of intervals",
            path.display()
        ))
        .advice("leave it out; --aov error adds the error of a picture to an .exr"))
    })
}
