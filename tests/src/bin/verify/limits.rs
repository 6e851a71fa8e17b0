//! Limits of size: lines of a file, lines of a function, columns of a line.

/// Most lines of a file; then the files that have more, with as many as they may have.
const MAX_LINES: usize = 400;
const LONG_FILES: &[(&str, usize)] = &[
    ("core/src/cache/octree.rs", 420),
    ("core/src/light/emission/mod.rs", 424),
    ("core/src/photon/tests.rs", 467),
    ("fuzz/src/shading.rs", 405),
    ("simd/src/baseline.rs", 418),
    ("simd/src/kernels/shade/tests.rs", 562),
    ("simd/src/x86/avx2.rs", 474),
    ("tests/tests/caustics.rs", 476),
];

/// Most lines of a function; then the functions that have more, with as many as they may have.
const MAX_FUNCTION_LINES: usize = 80;
const LONG_FUNCTIONS: &[(&str, usize)] = &[
    ("core/src/bvh/stream.rs: trace", 98),
    ("fuzz/src/bidirectional.rs: attempt", 90),
    ("fuzz/src/shading.rs: attempt", 169),
    ("simd/src/kernels/shade/tests.rs: scattering_is_the_same_on_every_level", 88),
    ("tests/lab/src/bench/shade/data.rs: new", 104),
    ("tests/tests/caustics.rs: guided_photons_reach_a_small_mirror_with_the_right_power", 82),
];

/// Most columns of a line. A line of code with a string may have more: rustfmt does not break strings.
const COLUMNS: usize = 110;

/// A complaint for each limit that the file exceeds.
pub(crate) fn check(name: &str, text: &str) -> Vec<String> {
    let mut complaints = Vec::new();
    let most = most(LONG_FILES, name, MAX_LINES);
    let lines = text.lines().count();
    if lines > most {
        complaints.push(format!("{name}: {lines} lines, {most} at most"));
    }
    complaints.extend(long_functions(name, text));
    complaints.extend(wide_lines(text).map(|line| format!("{name}:{line}: more than {COLUMNS} columns")));
    complaints
}

/// A complaint for each exception that names no file of the project.
pub(crate) fn check_exceptions<'n>(names: impl Iterator<Item = &'n str> + Clone) -> Vec<String> {
    let exceptions = LONG_FILES.iter().chain(LONG_FUNCTIONS).map(|(exception, _)| *exception);
    let is_gone = |exception: &&str| {
        let file = exception.split(": ").next().unwrap_or_default();
        !names.clone().any(|name| name == file)
    };
    let gone = exceptions.filter(is_gone);
    gone.map(|exception| format!("{exception}: no such file, but an exception of limits.rs")).collect()
}

fn most(exceptions: &[(&str, usize)], name: &str, usual: usize) -> usize {
    exceptions.iter().find(|(exception, _)| *exception == name).map_or(usual, |(_, most)| *most)
}

/// A complaint for each function that is too long. In code formatted by rustfmt a function ends at the first
/// closing brace in its own column.
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
        let most = most(LONG_FUNCTIONS, &format!("{name}: {function}"), MAX_FUNCTION_LINES);
        if length > most {
            let start = start + 1;
            complaints.push(format!("{name}:{start}: `{function}` has {length} lines, {most} at most"));
        }
    }
    complaints
}

/// Numbers of the lines longer than [`COLUMNS`], except code with a string.
fn wide_lines(text: &str) -> impl Iterator<Item = usize> {
    let wide = |(_, line): &(usize, &str)| {
        let is_comment = line.trim_start().starts_with("//");
        line.chars().count() > COLUMNS && (is_comment || !line.contains('"'))
    };
    text.lines().enumerate().filter(wide).map(|(index, _)| index + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_measured_in_characters() {
        let comment = format!("    // \"{}\"", "a".repeat(COLUMNS));
        let string = format!("    \"{}\"", "a".repeat(COLUMNS));
        let text = format!("{}\n{}\n{comment}\n{string}\n", "ä".repeat(COLUMNS), "a".repeat(COLUMNS + 1));
        assert_eq!(wide_lines(&text).collect::<Vec<_>>(), [2, 3]);
    }

    #[test]
    fn a_file_and_a_function_over_the_limit_are_named() {
        let body = "    a();\n".repeat(MAX_FUNCTION_LINES - 2);
        let text = |extra: &str| format!("//! A.\npub fn a() {{\n{body}{extra}}}\n");
        assert_eq!(check("core/src/a.rs", &text("")), [""; 0]);
        assert_eq!(
            check("core/src/a.rs", &text("    b();\n")),
            [format!("core/src/a.rs:2: `a` has 81 lines, {MAX_FUNCTION_LINES} at most")]
        );
        let long = "a;\n".repeat(MAX_LINES + 1);
        assert_eq!(check("b.rs", &long), [format!("b.rs: 401 lines, {MAX_LINES} at most")]);
    }

    #[test]
    fn an_exception_has_no_room_to_grow() {
        let (name, most) = LONG_FILES[0];
        assert_eq!(check(name, &"a;\n".repeat(most)), [""; 0]);
        assert_eq!(check(name, &"a;\n".repeat(most + 1)).len(), 1);
        assert_eq!(check_exceptions([].into_iter()).len(), LONG_FILES.len() + LONG_FUNCTIONS.len());
    }
}
