//! Layers of the core: a folder imports only from lower folders, also within light transport. In the core and
//! in the app the files and folders of a folder do not import each other in a cycle. The `mod.rs` of a folder
//! re-exports items of its files, and its files may import it.

use std::collections::{BTreeMap, BTreeSet};

/// Folders and files of core/src, lowest first. A new folder or file must be added here.
const LAYERS: &[&str] = &[
    "findings",
    "memory",
    "geometry",
    "features",
    "sampling",
    "scene",
    "bsdf",
    "bvh",
    "light",
    "film",
    "photon",
    "cache",
    "estimate",
    "census",
    "transport",
    "method",
    "reconstruction",
    "audit",
    "renderer",
    "parts",
];

/// Folders and files of core/src/transport, lowest first: subpaths, wavefront, path tracer, and the methods
/// built on it.
const TRANSPORT: &[&str] = &[
    "settings",
    "walk",
    "wavefront",
    "path",
    "photon_mapping",
    "caustics",
    "cached",
    "prepass",
    "bidirectional",
    "instant_radiosity",
    "metropolis",
];

/// Folder of the core.
const CORE: &str = "core/src";

/// Roots of crates that are checked.
pub(crate) const ROOTS: [&str; 2] = [CORE, "std-app/src"];

/// A file of a crate: its path below that folder, and its numbered lines of code.
pub(crate) struct Source<'t> {
    pub name: &'t str,
    pub code: Vec<(usize, &'t str)>,
}

/// A path of modules from the crate root, optionally ending in an item.
type Path = Vec<String>;

/// A complaint for each import cycle of the crate in folder `root`, and for each import from a higher layer
/// of the core.
pub(crate) fn check(root: &str, sources: &[Source]) -> Vec<String> {
    let tree = Tree::new(sources);
    let mut complaints = Vec::new();
    let mut edges: BTreeMap<Path, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (source, imports) in sources.iter().zip(&tree.imports) {
        let from = module_of(source.name);
        let layer = |path: &[String], depth: usize| if root == CORE { layer(path, depth) } else { Ok(None) };
        if let Some(missing) = (0..from.len()).find(|depth| layer(&from, *depth).is_err()) {
            let missing = &from[missing];
            complaints.push(format!("{root}/{}: `{missing}` is not among the layers", source.name));
            continue;
        }
        for import in imports {
            let Some(to) = tree.target(&from, &import.path) else { continue };
            let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
            match (from.get(shared), to.get(shared)) {
                (Some(lower), Some(higher)) if layer(&to, shared) > layer(&from, shared) => {
                    let (name, line) = (source.name, import.line);
                    complaints.push(format!("{root}/{name}:{line}: `{higher}` is a layer above `{lower}`"));
                }
                (Some(a), Some(b)) => {
                    let folder = edges.entry(from[..shared].to_vec()).or_default();
                    folder.entry(a.clone()).or_default().insert(b.clone());
                }
                _ => {}
            }
        }
    }
    complaints.extend(edges.into_iter().filter_map(|(folder, edges)| {
        let names = circle(edges);
        (!names.is_empty())
            .then(|| format!("{root}/{}: {} import in a circle", folder.join("/"), names.join(", ")))
    }));
    complaints
}

/// Layer of component `depth` of a path, `None` if that depth has no layers; an error if the component is not
/// listed.
fn layer(path: &[String], depth: usize) -> Result<Option<usize>, ()> {
    let layers = match (depth, path.first().map(String::as_str)) {
        (0, _) => LAYERS,
        (1, Some("transport")) => TRANSPORT,
        _ => return Ok(None),
    };
    let name = path.get(depth).ok_or(())?;
    layers.iter().position(|layer| layer == name).map(Some).ok_or(())
}

/// `a/b.rs` and `a/b/mod.rs` are module a::b.
fn module_of(name: &str) -> Path {
    let path = name.strip_suffix(".rs").unwrap_or(name);
    let mut path: Path = path.split('/').map(str::to_owned).collect();
    path.pop_if(|last| last == "mod" || last == "lib" || last == "main");
    path
}

/// Nodes of the graph that remain after repeated removal of nodes without outgoing or without incoming edges.
fn circle(mut edges: BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    loop {
        let count = edges.values().map(BTreeSet::len).sum::<usize>();
        let importing: BTreeSet<String> = edges.keys().cloned().collect();
        let imported: BTreeSet<String> = edges.values().flatten().cloned().collect();
        edges.values_mut().for_each(|targets| targets.retain(|target| importing.contains(target)));
        edges.retain(|name, targets| imported.contains(name) && !targets.is_empty());
        if edges.values().map(BTreeSet::len).sum::<usize>() == count {
            return edges.into_keys().collect();
        }
    }
}

/// An import, or a path within code.
#[derive(Debug, PartialEq)]
struct Import {
    line: usize,
    path: Path,
    /// Name of a re-export.
    exported: Option<String>,
}

/// All modules with their imports.
struct Tree {
    modules: BTreeSet<Path>,
    imports: Vec<Vec<Import>>,
    /// Target of each name that a module re-exports.
    exports: BTreeMap<(Path, String), Path>,
}

impl Tree {
    fn new(sources: &[Source]) -> Self {
        let modules = sources.iter().map(|source| module_of(source.name)).collect();
        let imports = sources.iter().map(|source| imports(&source.code)).collect();
        let mut tree = Tree { modules, imports, exports: BTreeMap::new() };
        for (source, imports) in sources.iter().zip(&tree.imports) {
            let module = module_of(source.name);
            for import in imports {
                if let (Some(name), Some(path)) = (&import.exported, tree.absolute(&module, &import.path)) {
                    tree.exports.insert((module.clone(), name.clone()), path);
                }
            }
        }
        tree
    }

    /// Absolute form of a path written in `module`; `None` for a path into another crate.
    fn absolute(&self, module: &Path, path: &[String]) -> Option<Path> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        let base = module.len().checked_sub(ups)?;
        match path.first()?.as_str() {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([module, &path[1..]].concat()),
            "super" => Some([&module[..base], &path[ups..]].concat()),
            child => {
                let inner = [module.as_slice(), &[child.to_owned()]].concat();
                self.modules.contains(&inner).then(|| [module.as_slice(), path].concat())
            }
        }
    }

    /// Module that defines the item of an import, through re-exports.
    fn target(&self, module: &Path, path: &[String]) -> Option<Path> {
        let mut path = self.absolute(module, path)?;
        for _ in 0..LAYERS.len() {
            let depth = (0..=path.len()).rev().find(|depth| self.modules.contains(&path[..*depth]))?;
            let exported = path.get(depth).and_then(|name| {
                self.exports
                    .get(&(path[..depth].to_vec(), name.clone()))
                    .map(|to| [to, &path[depth + 1..]].concat())
            });
            match exported {
                Some(next) => path = next,
                None => return Some(path[..depth].to_vec()),
            }
        }
        None
    }
}

/// Imports of a file, and paths in its other code that begin with `crate` or `super`.
fn imports(code: &[(usize, &str)]) -> Vec<Import> {
    let mut found = Vec::new();
    let mut lines = code.iter();
    while let Some(&(line, text)) = lines.next() {
        let text = text.trim();
        let Some((before, tree)) = text.split_once("use ").filter(|(before, _)| is_visibility(before)) else {
            found.extend(paths(text).map(|path| Import { line, path, exported: None }));
            continue;
        };
        let mut tree = tree.to_owned();
        while !tree.contains(';') {
            let Some((_, more)) = lines.next() else { break };
            tree += more.trim();
        }
        let mut all = Vec::new();
        expand(tree.trim_end_matches(';'), &[], &mut all);
        found.extend(all.into_iter().map(|(path, name)| Import {
            line,
            path,
            exported: Some(name).filter(|_| before.starts_with("pub")),
        }));
    }
    found
}

fn is_visibility(before: &str) -> bool {
    let before = before.trim();
    before.is_empty() || before == "pub" || before.starts_with("pub(") && before.ends_with(')')
}

/// `a::{b, c as d}` gives a::b, and a::c by the name d.
fn expand(tree: &str, outer: &[String], all: &mut Vec<(Path, String)>) {
    let segments = |text: &str| -> Path {
        text.split("::").map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect()
    };
    if let Some((head, rest)) = tree.split_once('{') {
        let outer = [outer, &segments(head)].concat();
        let body = rest.rsplit_once('}').map_or(rest, |(body, _)| body);
        let mut depth = 0;
        let parts = body.split(|c| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            c == ',' && depth == 0
        });
        return parts.filter(|part| !part.trim().is_empty()).for_each(|part| expand(part, &outer, all));
    }
    let (path, renamed) = tree.split_once(" as ").map_or((tree, None), |(path, name)| (path, Some(name)));
    let mut path = [outer, &segments(path)].concat();
    path.pop_if(|last| last == "self" && !outer.is_empty());
    let name = renamed.map(str::trim).or(path.last().map(String::as_str)).unwrap_or_default().to_owned();
    all.push((path, name));
}

/// Paths that begin with `crate::` or `super::` in a line of code.
fn paths(line: &str) -> impl Iterator<Item = Path> {
    let words = line.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
    let from_here = |word: &&str| word.starts_with("crate::") || word.starts_with("super::");
    words
        .filter(from_here)
        .map(|word| word.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaints(files: &[(&str, &str)]) -> Vec<String> {
        let source = |(name, text): &(&'static str, &'static str)| Source {
            name,
            code: text.lines().enumerate().map(|(i, line)| (i + 1, line)).collect(),
        };
        let files: Vec<(&'static str, &'static str)> =
            files.iter().map(|&(a, b)| (leak(a), leak(b))).collect();
        check(CORE, &files.iter().map(source).collect::<Vec<_>>())
    }

    fn leak(text: &str) -> &'static str {
        Box::leak(text.to_owned().into_boxed_str())
    }

    #[test]
    fn a_layer_imports_those_below_it_and_none_above() {
        let lower = ("scene/mesh.rs", "use crate::geometry::Ray;\nuse crate::{Rgb, memory::Arena};\n");
        assert_eq!(complaints(&[("geometry/ray.rs", ""), ("memory/mod.rs", ""), lower]), [""; 0]);
        let upper =
            ("scene/mesh.rs", "use crate::Rgb;\nuse crate::{\n    geometry::Ray,\n    light::Tree,\n};\n");
        let found = complaints(&[("light/mod.rs", ""), ("geometry/ray.rs", ""), upper]);
        assert_eq!(found, ["core/src/scene/mesh.rs:2: `light` is a layer above `scene`"]);
        let within = ("scene/mesh.rs", "fn a() {\n    crate::light::tree::b();\n}\n");
        let found = complaints(&[("light/tree.rs", ""), within]);
        assert_eq!(found, ["core/src/scene/mesh.rs:2: `light` is a layer above `scene`"]);
        let face = ("scene/mod.rs", "pub use super::light::Tree;\n");
        assert_eq!(complaints(&[("light/mod.rs", ""), face]).len(), 1);
    }

    #[test]
    fn a_folder_that_is_no_layer_is_refused() {
        assert_eq!(
            complaints(&[("extra/mod.rs", "")]),
            ["core/src/extra/mod.rs: `extra` is not among the layers"]
        );
        assert_eq!(complaints(&[("lib.rs", "pub mod transport;\nuse crate::transport::X;\n")]), [""; 0]);
    }

    #[test]
    fn files_of_a_folder_form_no_circle() {
        let face = ("bvh/mod.rs", "mod a;\nmod b;\nuse a::A;\n");
        let (a, b) =
            (("bvh/a.rs", "use super::b::B;\nuse super::Bvh;\n"), ("bvh/b.rs", "use crate::bvh::a;\n"));
        assert_eq!(complaints(&[face, a, ("bvh/b.rs", "use super::Bvh;\n")]), [""; 0]);
        assert_eq!(complaints(&[face, a, b]), ["core/src/bvh: a, b import in a circle"]);
        // A file that only imports from the cycle is not part of it.
        let c = ("bvh/c.rs", "use super::a::A;\n");
        assert_eq!(complaints(&[face, a, b, c]), ["core/src/bvh: a, b import in a circle"]);
    }

    #[test]
    fn folders_of_the_app_form_no_circle() {
        let source = |name, line| Source { name, code: vec![(1, line)] };
        let sources =
            [source("load/mod.rs", "use crate::render::A;"), source("render/mod.rs", "use crate::load::B;")];
        assert_eq!(check("std-app/src", &sources), ["std-app/src/: load, render import in a circle"]);
        assert_eq!(check("std-app/src", &sources[..1]), [""; 0]);
        let face = source("main.rs", "use load::B;");
        assert_eq!(check("std-app/src", &[face, source("load.rs", "use crate::Other;")]), [""; 0]);
    }

    #[test]
    fn a_folder_of_transport_imports_those_below_it() {
        let path = ("transport/path/mod.rs", "use crate::transport::walk::mis;\nuse super::cached::X;\n");
        let others = [("transport/walk/mis.rs", ""), ("transport/cached.rs", "use super::path::Y;\n")];
        assert_eq!(
            complaints(&[path, others[0], others[1]]),
            ["core/src/transport/path/mod.rs:2: `cached` is a layer above `path`"]
        );
        assert_eq!(
            complaints(&[("transport/extra.rs", "")]),
            ["core/src/transport/extra.rs: `extra` is not among the layers"]
        );
    }

    #[test]
    fn circles_are_found_through_what_a_folder_exports() {
        let face = ("bvh/mod.rs", "pub use a::{A, Other as Name};\npub(crate) use b::B;\n");
        let (a, b) = (("bvh/a.rs", "use super::B;\n"), ("bvh/b.rs", "use super::Name;\n"));
        assert_eq!(complaints(&[face, a, b]), ["core/src/bvh: a, b import in a circle"]);
    }

    #[test]
    fn folders_within_a_folder_are_as_one_file() {
        let a = ("bvh/a/x.rs", "use super::y::Y;\nuse crate::bvh::b::B;\n");
        let (y, b) = (("bvh/a/y.rs", ""), ("bvh/b.rs", "use super::a::y::Y;\n"));
        assert_eq!(complaints(&[a, y, b]), ["core/src/bvh: a, b import in a circle"]);
        assert_eq!(complaints(&[a, y, ("bvh/b.rs", "")]), [""; 0]);
    }
}
