//! House rules that no compiler checks, verified line by line in the source.

use crate::layers::{self, Source};
use crate::{Failure, Outcome, Project};
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
        folders: &["core/src", "std-app/src", "tests/src", "tests/tests", "tests/lab/src", "tests/support"],
        words: &["unsafe ", "unsafe{"],
        unless: &["\"unsafe"],
        because: "only simd/ may be unsafe",
    },
    Rule {
        folders: &["std-app/src"],
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

/// Most lines of a file.
const MAX_LINES: usize = 600;

/// Most lines of a file of the core, unit tests included; then the files that still exceed it.
const MAX_CORE_LINES: usize = 400;
const LONG_FILES: &[&str] =
    &["core/src/cache/octree.rs", "core/src/light/emission/mod.rs", "core/src/photon/tests.rs"];

/// Most lines of a function of the core; then the exceptions: a kernel, and the textbook path tracer, which
/// is read as a whole.
const MAX_FUNCTION_LINES: usize = 80;
const LONG_FUNCTIONS: &[&str] =
    &["core/src/bvh/stream.rs: trace", "core/src/transport/path/reference.rs: radiance"];

/// Most columns of a line, comments included, which rustfmt does not wrap.
const COLUMNS: usize = 110;

/// Code whose lines have at most [`COLUMNS`] columns. Elsewhere that holds for comments: strings and tables
/// of tests stay whole.
const NARROW: &[&str] = &["core/src", "tests/src/bin/verify/layers.rs"];

/// Folders of tests, each with the program that has their files as modules.
const TEST_PROGRAMS: [(&str, &str); 2] =
    [("tests/tests/", "tests/tests/main.rs"), ("std-app/tests/", "std-app/tests/main.rs")];

pub(crate) fn check(project: &Project) -> Outcome {
    let mut files = Vec::new();
    for folder in ["simd", "core", "std-app", "tests", "fuzz"] {
        rust_files(&project.root.join(folder), &mut files);
    }
    files.sort();
    let mut texts = Vec::new();
    for path in &files {
        let text = fs::read_to_string(path);
        texts.push(text.map_err(|error| Failure::Failed(format!("{}: {error}", path.display())))?);
    }
    let test_modules: Vec<PathBuf> =
        files.iter().zip(&texts).flat_map(|(path, text)| test_modules(path, text)).collect();

    let in_test = |path: &Path| {
        test_modules.iter().any(|module| path.starts_with(module) || *path == module.with_extension("rs"))
    };
    let name_of = |path: &PathBuf| {
        path.strip_prefix(&project.root).unwrap_or(path).to_string_lossy().replace('\\', "/")
    };
    let names: Vec<String> = files.iter().map(name_of).collect();

    let mut complaints = Vec::new();
    let mut core = Vec::new();
    for ((path, name), text) in files.iter().zip(&names).zip(&texts) {
        let lines = text.lines().count();
        let is_core = name.starts_with("core/src/");
        let most = if is_core && !LONG_FILES.contains(&name.as_str()) { MAX_CORE_LINES } else { MAX_LINES };
        if lines > most {
            complaints.push(format!("{name}: {lines} lines, {most} at most"));
        }
        if is_core {
            complaints.extend(long_functions(name, text));
        }
        if !text.starts_with("//!") {
            complaints.push(format!("{name}:1: the file does not open with `//!` and what lives in it"));
        }
        let is_narrow = NARROW.iter().any(|folder| name.starts_with(folder));
        complaints.extend(
            wide_lines(text, is_narrow).map(|line| format!("{name}:{line}: more than {COLUMNS} columns")),
        );
        if !in_test(path) {
            complaints.extend(broken_rules(name, text));
            let below = name.strip_prefix("core/src/");
            core.extend(below.map(|name| Source { name, code: code(text) }));
        }
    }
    for (root, program) in TEST_PROGRAMS {
        let text = names.iter().zip(&texts).find(|(name, _)| *name == program).map_or("", |(_, text)| text);
        let files = names.iter().filter_map(|name| name.strip_prefix(root));
        complaints.extend(
            modules_left_out(text, files).map(|name| format!("{root}{name}: {program} does not name it")),
        );
    }
    complaints.extend(layers::check(&core));
    complaints.iter().for_each(|complaint| println!("{complaint}"));
    match complaints.len() {
        0 => Ok(format!("{} files", files.len())),
        count => Err(Failure::Failed(format!("{count} complaints"))),
    }
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

/// A complaint for each function longer than [`MAX_FUNCTION_LINES`]. In code formatted by rustfmt a function
/// ends at the first closing brace in its own column.
fn long_functions(name: &str, text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().collect();
    let function = |line: &str| {
        let (before, after) = line.split_once("fn ")?;
        let is_start = before.split_whitespace().all(|word| {
            word.starts_with("pub") || word == "const" || word == "unsafe" || word.ends_with(')')
        });
        is_start.then(|| after.split(['(', '<']).next().unwrap_or_default().to_owned())
    };
    let mut complaints = Vec::new();
    for (start, line) in lines.iter().enumerate() {
        let Some(function) = function(line).filter(|function| !function.contains(' ')) else { continue };
        let indent = &line[..line.len() - line.trim_start().len()];
        let end = format!("{indent}}}");
        let is_one_line = line.trim_end().ends_with(['}', ';']);
        let length = lines[start..].iter().position(|line| is_one_line || *line == end).map_or(0, |i| i + 1);
        let known = LONG_FUNCTIONS.contains(&format!("{name}: {function}").as_str());
        if length > MAX_FUNCTION_LINES && !known {
            let start = start + 1;
            complaints.push(format!(
                "{name}:{start}: `{function}` has {length} lines, {MAX_FUNCTION_LINES} at most"
            ));
        }
    }
    complaints
}

/// Numbers of the lines longer than [`COLUMNS`]: of all lines with `code`, else of comments.
fn wide_lines(text: &str, code: bool) -> impl Iterator<Item = usize> {
    let wide = move |(_, line): &(usize, &str)| {
        line.chars().count() > COLUMNS && (code || line.trim_start().starts_with("//"))
    };
    text.lines().enumerate().filter(wide).map(|(index, _)| index + 1)
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

/// Collects every `.rs` file below `folder`, except build products and tests.
fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match path.is_dir() {
            true if ["target", "corpus", "artifacts", "venv", "output"].contains(&&*name) => {}
            true => rust_files(&path, files),
            false if name.ends_with(".rs") => files.push(path),
            false => {}
        }
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
    fn lines_are_measured_in_characters() {
        let comment = format!("    // {}", "a".repeat(COLUMNS));
        let text = format!("{}\n{}\n{comment}\n", "ä".repeat(COLUMNS), "a".repeat(COLUMNS + 1));
        assert_eq!(wide_lines(&text, true).collect::<Vec<_>>(), [2, 3]);
        assert_eq!(wide_lines(&text, false).collect::<Vec<_>>(), [3]);
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
