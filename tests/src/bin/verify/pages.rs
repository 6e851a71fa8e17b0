//! Pages: links from pages and from code lead to files and headings that exist, and pages of decisions name
//! identifiers, files and flags that exist.

use std::collections::{BTreeMap, BTreeSet, HashSet};

/// A file: its path from the root, and its text.
pub(crate) type Text<'t> = (&'t str, &'t str);

/// Pages whose identifiers must exist in the code.
const DECISIONS: &str = "docs/decisions/";

/// Pages of decisions that describe what is gone.
const HISTORY: &str = "docs/decisions/removed.md";

/// Page of all flags of the program.
const FLAGS: &str = "docs/cli.md";

/// Names of the standard library and of the machine.
const FOREIGN: &[&str] = &["_mm256_mul_ps", "core_arch", "x86"];

/// This file, whose tests name pages that do not exist.
const OWN_TESTS: &str = "tests/src/bin/verify/pages.rs";

/// A complaint for each broken link, and for each identifier that the code does not have. `names` are the
/// paths of all files and folders of the project.
pub(crate) fn check(pages: &[Text], code: &[Text], names: &BTreeSet<String>) -> Vec<String> {
    let anchors: BTreeMap<&str, BTreeSet<String>> =
        pages.iter().map(|(name, text)| (*name, anchors(text))).collect();
    let resolve = |path: &str, anchor: &str| match anchors.get(path) {
        _ if !names.contains(path) => Some(format!("no file `{path}`")),
        Some(anchors) if !anchor.is_empty() && !anchors.contains(anchor) => {
            Some(format!("`{path}` has no heading `#{anchor}`"))
        }
        _ => None,
    };
    let mut complaints = Vec::new();
    for (name, text) in pages {
        for (line, target) in links(text) {
            if target.contains("://") {
                continue;
            }
            let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = if path.is_empty() { (*name).to_owned() } else { joined(name, path) };
            complaints.extend(resolve(&path, anchor).map(|why| format!("{name}:{line}: {why}")));
        }
    }
    for (name, text) in code.iter().filter(|(name, _)| *name != OWN_TESTS) {
        for (line, target) in mentions(text) {
            let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
            complaints.extend(resolve(path, anchor).map(|why| format!("{name}:{line}: {why}")));
        }
    }
    complaints.extend(unknown_identifiers(pages, code, names));
    complaints
}

/// A complaint for each code span in pages of decisions that is no identifier, file or flag.
fn unknown_identifiers(pages: &[Text], code: &[Text], names: &BTreeSet<String>) -> Vec<String> {
    let of_code = code.iter().flat_map(|(_, text)| words(text));
    let words: HashSet<&str> = of_code.chain(FOREIGN.iter().copied()).collect();
    let flags = pages.iter().find(|(name, _)| *name == FLAGS).map_or("", |(_, text)| text);
    let is_file = |path: &str| names.iter().any(|name| name == path || name.ends_with(&format!("/{path}")));
    let is_known = |term: &str| match Term::of(term) {
        Some(Term::Flag(flag)) => flags.contains(flag),
        Some(Term::Path(path)) => is_file(path),
        Some(Term::Identifier(path)) => path.split("::").all(|name| words.contains(name)),
        None => true,
    };
    let decisions = pages.iter().filter(|(name, _)| name.starts_with(DECISIONS) && *name != HISTORY);
    let terms = decisions.flat_map(|(name, text)| spans(text).map(move |(line, span)| (name, line, span)));
    terms
        .filter(|(.., span)| !is_known(span))
        .map(|(name, line, span)| format!("{name}:{line}: the code has no `{span}`"))
        .collect()
}

/// Meaning of a code span.
enum Term<'t> {
    Flag(&'t str),
    Path(&'t str),
    Identifier(&'t str),
}

impl<'t> Term<'t> {
    /// `None` for values, formulas, command lines, and names of scenes.
    fn of(span: &'t str) -> Option<Self> {
        let is_name = |text: &str| text.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
        let is_rust = |text: &str| text.chars().all(|c| c.is_ascii_alphanumeric() || "_:".contains(c));
        let first = span.split_whitespace().next()?;
        let ends = [".rs", ".py", ".md", ".txt", ".toml", ".obj"];
        match span {
            _ if span.starts_with("--") => Some(Self::Flag(first.split('=').next()?)),
            _ if is_name(span) && (span.contains('/') || ends.iter().any(|end| span.ends_with(end))) => {
                Some(Self::Path(span.trim_end_matches('/')))
            }
            _ if is_rust(span) && span.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') => {
                Some(Self::Identifier(span))
            }
            _ => None,
        }
    }
}

/// Path of a link in `page`, from the root of the project.
fn joined(page: &str, link: &str) -> String {
    let mut path: Vec<&str> = page.split('/').collect();
    path.pop();
    for part in link.trim_end_matches('/').split('/') {
        match part {
            ".." => drop(path.pop()),
            "." => {}
            name => path.push(name),
        }
    }
    path.join("/")
}

/// Targets of the links of a page, in text and in definitions, with their lines.
fn links(text: &str) -> Vec<(usize, &str)> {
    let mut links = Vec::new();
    for (start, _) in text.match_indices("](") {
        let target = text[start + 2..].split(')').next().unwrap_or_default();
        links.push((line_of(text, start), target));
    }
    for (index, line) in text.lines().enumerate() {
        let definition = line.strip_prefix('[').and_then(|line| line.split_once("]: "));
        links.extend(definition.map(|(_, target)| (index + 1, target.trim())));
    }
    links
}

/// Pages that a file of code names, with their lines.
fn mentions(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_path = |c: char| c.is_ascii_alphanumeric() || "_-./#".contains(c);
    text.match_indices("docs/").filter_map(move |(start, _)| {
        let rest = &text[start..];
        let path = rest.split(|c| !is_path(c)).next().unwrap_or_default().trim_end_matches('.');
        let is_whole = !text[..start].ends_with(is_path);
        (is_whole && path.contains(".md")).then(|| (line_of(text, start), path))
    })
}

/// Code spans of a page with their lines, without blocks of code.
fn spans(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut end = 0;
    let parts = text.split('`').map(move |part| {
        let start = end;
        end += part.len() + 1;
        (start, part)
    });
    parts.skip(1).step_by(2).map(|(start, part)| (line_of(text, start), part))
}

/// Anchors of the headings of a page, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let anchor = |line: &str| {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || "_- ".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
}

fn line_of(text: &str, position: usize) -> usize {
    text[..position].matches('\n').count() + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaints(page: &str, code: &str) -> Vec<String> {
        let pages = [
            ("docs/decisions/a.md", page),
            ("docs/b.md", "# B\n## Pairs, quads\n"),
            (FLAGS, "- `--spp N`: samples"),
        ];
        let code = [("core/src/light/tree.rs", code)];
        let names = pages.iter().chain(&code).map(|(name, _)| (*name).to_owned()).collect();
        check(&pages, &code, &names)
    }

    #[test]
    fn links_lead_to_files_and_headings() {
        let page =
            "# A\n[b](../b.md) [b](../b.md#pairs-quads) [a](#a) [web](https://x.org/y)\n[c]: ../b.md\n";
        assert_eq!(complaints(page, "// docs/b.md, docs/b.md#pairs-quads.\n"), [""; 0]);
        assert_eq!(complaints("[b\nb](b.md)", ""), ["docs/decisions/a.md:2: no file `docs/decisions/b.md`"]);
        assert_eq!(
            complaints("\n[b](../b.md#quads)", ""),
            ["docs/decisions/a.md:2: `docs/b.md` has no heading `#quads`"]
        );
        assert_eq!(complaints("", "\n// docs/c.md"), ["core/src/light/tree.rs:2: no file `docs/c.md`"]);
    }

    #[test]
    fn decisions_name_identifiers_files_and_flags_that_exist() {
        let code = "pub struct Tree; impl Tree { fn walk() {} }";
        assert_eq!(
            complaints("`Tree::walk`, `light/tree.rs`, `--spp 16`, `1e-4`, `a b`, `two-rooms`", code),
            [""; 0]
        );
        for (span, line) in [("`Tree::run`", 1), ("\n`light/list.rs`", 2), ("`--time`", 1), ("`forget`", 1)] {
            let span_text = span.trim().trim_matches('`');
            let expected = format!("docs/decisions/a.md:{line}: the code has no `{span_text}`");
            assert_eq!(complaints(span, code), [expected]);
        }
    }
}
