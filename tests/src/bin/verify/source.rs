//! House rules that no compiler checks, verified line by line in sources and pages.

use crate::layers::{self, Source};
use crate::pages::{self, Text};
use crate::{Failure, Outcome, Project, limits, names};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Words forbidden in the code of some folders; tests and comments are exempt.
struct Rule {
    folders: &'static [&'static str],
    words: &'static [&'static str],
    unless: &'static [&'static str],
    because: &'static str,
}

const RULES: &[Rule] = &[
    Rule {
        folders: &["core/src"],
        words: &[
            ".unwrap()",
            ".expect(",
            "panic!",
            "todo!",
            "unimplemented!",
            "unreachable!",
            "assert!(",
            "assert_eq!(",
            "assert_ne!(",
        ],
        // Assertions that the compiler evaluates or leaves out.
        unless: &["const _", "const {", "debug_assert"],
        because: "the core returns values, it does not panic",
    },
    Rule {
        folders: &["core/src", "simd/src"],
        words: &["std::", "alloc::"],
        unless: &[],
        because: "core and simd have neither std nor alloc",
    },
    Rule {
        folders: &[
            "core/src",
            "std-app/src",
            "std-app/bindings",
            "tests/src",
            "tests/tests",
            "tests/lab/src",
            "tests/support",
        ],
        words: &["unsafe ", "unsafe{"],
        unless: &["\"unsafe"],
        because: "only simd/ may be unsafe",
    },
    Rule {
        folders: &["std-app/src", "std-app/bindings/python/src"],
        words: &["print!(", "println!("],
        unless: &[],
        because: "it panics where nobody reads; std-app/src/cli/stdio.rs does not",
    },
    Rule {
        folders: &["core/src"],
        words: &[".mul_add(", "::mul_add("],
        unless: &[],
        because: "fused operations differ between targets",
    },
];

/// Folders that hold products, corpora, and pictures of runs.
const LEFT_OUT: &[&str] = &["target", "corpus", "artifacts", "venv", "output", ".git", "__pycache__"];

/// Ends of the names of files that are read.
const TEXTS: &[&str] = &[".rs", ".md", ".py", ".toml"];

/// A file that is read: its path from the root, and its text.
struct File {
    name: String,
    path: PathBuf,
    text: String,
}

impl File {
    fn text(&self) -> Text<'_> {
        (&self.name, &self.text)
    }
}

/// Folders of tests, each with the program that has their files as modules.
const TEST_PROGRAMS: [(&str, &str); 2] =
    [("tests/tests/", "tests/tests/main.rs"), ("std-app/tests/", "std-app/tests/main.rs")];

pub(crate) fn check(project: &Project) -> Outcome {
    let mut paths = Vec::new();
    collect(&project.root, &mut paths);
    paths.sort();
    let name_of = |path: &PathBuf| {
        path.strip_prefix(&project.root).unwrap_or(path).to_string_lossy().replace('\\', "/")
    };
    let names: BTreeSet<String> = paths.iter().map(name_of).collect();
    let mut files = Vec::new();
    for path in paths.into_iter().filter(|path| path.is_file()) {
        let name = name_of(&path);
        if TEXTS.iter().any(|end| name.ends_with(end)) {
            let text = fs::read_to_string(&path);
            let text = text.map_err(|error| Failure::Failed(format!("{}: {error}", path.display())))?;
            files.push(File { name, path, text });
        }
    }

    let (sources, others): (Vec<&File>, Vec<&File>) =
        files.iter().partition(|file| file.name.ends_with(".rs") && !file.name.starts_with('.'));
    let mut complaints = check_sources(&sources);
    let (pages, scripts): (Vec<&File>, Vec<&File>) =
        others.into_iter().partition(|file| file.name.ends_with(".md"));
    let pages: Vec<_> = pages.iter().map(|file| file.text()).collect();
    let code: Vec<_> = sources.iter().chain(&scripts).map(|file| file.text()).collect();
    complaints.extend(pages::check(&pages, &code, &names));

    complaints.iter().for_each(|complaint| println!("{complaint}"));
    match complaints.len() {
        0 => Ok(format!("{} files, {} pages", sources.len(), pages.len())),
        count => Err(Failure::Failed(format!("{count} complaints"))),
    }
}

/// Complaints about files of Rust.
fn check_sources(files: &[&File]) -> Vec<String> {
    let test_modules: Vec<PathBuf> =
        files.iter().flat_map(|file| test_modules(&file.path, &file.text)).collect();
    let in_test = |path: &Path| {
        test_modules.iter().any(|module| path.starts_with(module) || *path == module.with_extension("rs"))
    };
    let mut complaints = limits::check_exceptions(files.iter().map(|file| file.name.as_str()));
    let mut crates = layers::ROOTS.map(|root| (root, Vec::new()));
    for File { name, path, text } in files {
        complaints.extend(limits::check(name, text));
        complaints.extend(names::check(name, text));
        if !text.starts_with("//!") {
            complaints.push(format!("{name}:1: the file does not open with `//!` and what lives in it"));
        }
        if !in_test(path) {
            complaints.extend(broken_rules(name, text));
            let of_crate = crates.iter_mut().find_map(|(root, sources)| {
                let below = name.strip_prefix(*root)?.strip_prefix('/')?;
                Some((below, sources))
            });
            if let Some((name, sources)) = of_crate {
                sources.push(Source { name, code: code(text) });
            }
        }
    }
    for (root, program) in TEST_PROGRAMS {
        let text = files.iter().find(|file| file.name == program).map_or("", |file| &file.text);
        let names = files.iter().filter_map(|file| file.name.strip_prefix(root));
        complaints.extend(
            modules_left_out(text, names).map(|name| format!("{root}{name}: {program} does not name it")),
        );
    }
    complaints.extend(crates.iter().flat_map(|(root, sources)| layers::check(root, sources)));
    complaints
}

/// A complaint for each line of the file that breaks a rule.
fn broken_rules(name: &str, text: &str) -> Vec<String> {
    let mut complaints = Vec::new();
    let rules = RULES.iter().filter(|rule| rule.folders.iter().any(|folder| name.starts_with(folder)));
    for rule in rules {
        for (number, line) in code(text) {
            let found = rule.words.iter().find(|word| line.contains(**word));
            if let Some(word) = found.filter(|_| !rule.unless.iter().any(|word| line.contains(word))) {
                complaints.push(format!("{name}:{number}: `{}`: {}", word.trim(), rule.because));
            }
        }
    }
    complaints
}

/// Files that are no modules of the program of their folder: their tests would never run.
fn modules_left_out<'t>(
    program: &'t str,
    files: impl Iterator<Item = &'t str>,
) -> impl Iterator<Item = &'t str> {
    files.filter(move |file| {
        let name = file.strip_suffix("/mod.rs").or(file.strip_suffix(".rs")).unwrap_or(file);
        let module = format!("mod {name};");
        name != "main" && !name.contains('/') && !program.lines().any(|line| line == module)
    })
}

/// File modules that are compiled for tests alone: paths without `.rs`.
fn test_modules(path: &Path, text: &str) -> Vec<PathBuf> {
    let stem = path.file_stem().unwrap_or_default();
    let own = path.parent().unwrap_or(path);
    let root = ["mod", "lib", "main"].iter().any(|name| stem == *name);
    let folder = if root { own.to_owned() } else { own.join(stem) };
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let pairs = lines.windows(2).filter(|pair| pair[0] == "#[cfg(test)]");
    pairs
        .filter_map(|pair| pair[1].strip_prefix("mod ")?.strip_suffix(';'))
        .map(|name| folder.join(name))
        .collect()
}

/// Numbered lines of code, without comments, tests and code of `std` builds.
fn code(text: &str) -> Vec<(usize, &str)> {
    let bare = |line: &'_ str| line.split("//").next().unwrap_or_default().trim_end().len();
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, &line[..bare(line)]));
    let mut kept = Vec::new();
    while let Some((number, line)) = lines.next() {
        let attribute = |line: &str| line.trim_start().starts_with("#[");
        if !(attribute(line)
            && (line.contains("cfg(test") || line.contains("(test,") || line.contains("\"std\"")))
        {
            kept.push((number, line));
            continue;
        }
        // The item below the attribute, with its body if any.
        let item = lines.find(|(_, line)| !line.is_empty() && !attribute(line)).map_or("", |(_, item)| item);
        let indent = |line: &str| line.len() - line.trim_start().len();
        if item.ends_with('{') {
            lines.find(|(_, line)| !line.is_empty() && indent(line) == indent(item));
        }
    }
    kept
}

/// Collects files and folders below `folder`, except products and corpora.
fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            if LEFT_OUT.contains(&&*name) {
                continue;
            }
            collect(&path, paths);
        }
        paths.push(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_tests_are_not_code() {
        let text =
            "let a = 1; // panic!\n#[cfg(test)]\nmod tests {\n    panic!()\n}\n#[cfg(test)]\nuse x;\nlet b;";
        assert_eq!(code(text), [(1, "let a = 1;"), (8, "let b;")]);
    }

    #[test]
    fn a_file_of_tests_without_a_module_is_named() {
        let files = ["main.rs", "a.rs", "b/mod.rs", "b/c.rs", "d.rs"];
        let left_out: Vec<_> = modules_left_out("mod a;\nmod b;\n", files.into_iter()).collect();
        assert_eq!(left_out, ["d.rs"]);
    }

    #[test]
    fn a_module_of_tests_in_its_own_file_is_found() {
        let text = "mod a;\n#[cfg(test)]\nmod b;\n#[cfg(test)]\nmod tests {\n}\n";
        assert_eq!(test_modules(Path::new("x/mod.rs"), text), [Path::new("x/b")]);
        assert_eq!(test_modules(Path::new("x/y.rs"), text), [Path::new("x/y/b")]);
    }
}
