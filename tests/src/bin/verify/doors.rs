//! Doors of the core: the public names that its documentation shows, against the list in `core/doors.txt`.

use crate::command::{command, run};
use crate::{Failure, Outcome, Project};
use std::fs;
use std::path::{Path, PathBuf};

/// Most items that the documentation may show, so that the front stays a front.
const MOST_ITEMS: usize = 250;

/// Most changed names in a message.
const MOST_SHOWN: usize = 8;

/// The list, and the variable that writes it anew.
const LIST: &str = "core/doors.txt";
const VARIABLE: &str = "SNAPSHOT";

/// Types of signatures that other crates document, glam and bytemuck, and names within a type.
const FOREIGN: [&str; 7] = ["AnyBitPattern", "Item", "Mat3", "NoUninit", "Self", "Vec2", "Vec3"];

/// Kinds of names within an item.
const KINDS: [&str; 5] = ["method", "tymethod", "variant", "structfield", "associatedconstant"];

pub(crate) fn check(project: &Project) -> Outcome {
    let line = "cargo rustdoc --profile quick --quiet --locked --package halflight-core --lib";
    // Links to private modules are judged by the step of the documentation.
    run(command(&project.root, line).env("RUSTDOCFLAGS", "-A rustdoc::private_intra_doc_links"))?;
    let pages = project.root.join("target/doc/halflight_core");
    let failed = |error| Failure::Failed(format!("{}: {error}", pages.display()));
    let found = doors(&pages).map_err(failed)?;
    if let Some((file, name)) = unnamed(&pages).map_err(failed)? {
        return Err(Failure::Failed(format!(
            "{}: a signature has the type `{name}`, which no user can name: export it, or hide what has it",
            file.display()
        )));
    }
    let items = found.lines().filter(|line| !line.starts_with(' ')).count();
    if items > MOST_ITEMS {
        return Err(Failure::Failed(format!("the core shows {items} items, more than {MOST_ITEMS}")));
    }
    let list = project.root.join(LIST);
    if std::env::var(VARIABLE).is_ok_and(|value| value == "write") {
        fs::write(&list, &found).map_err(|error| Failure::Failed(format!("{LIST}: {error}")))?;
    }
    let promised = fs::read_to_string(&list).unwrap_or_default();
    let gone: Vec<&str> = lost(&promised, &found);
    let new: Vec<&str> = lost(&found, &promised);
    match gone.is_empty() && new.is_empty() {
        true => Ok(format!("{items} items, {} names", found.lines().count())),
        false => Err(Failure::Failed(format!(
            "the doors of the core have changed: gone {gone:?}, new {new:?}; a promised name must stay within a \
             version, and {VARIABLE}=write records the others"
        ))),
    }
}

/// Lines of `one` that `other` lacks.
fn lost<'t>(one: &'t str, other: &str) -> Vec<&'t str> {
    let known: std::collections::HashSet<&str> = other.lines().collect();
    one.lines().filter(|line| !known.contains(line)).take(MOST_SHOWN).collect()
}

/// Items of a crate's documentation, and the names in each, a line each.
fn doors(pages: &Path) -> std::io::Result<String> {
    let all = fs::read_to_string(pages.join("all.html"))?;
    let main = all.split_once("<h3 id=").map_or("", |(_, main)| main);
    let mut lines = Vec::new();
    for link in main.split("<a href=\"").skip(1) {
        let Some((file, rest)) = link.split_once("\">") else { continue };
        let Some((name, _)) = rest.split_once("</a>") else { continue };
        let kind = file.rsplit('/').next().and_then(|page| page.split('.').next()).unwrap_or_default();
        lines.push(format!("{kind} {name}"));
        let page = fs::read_to_string(pages.join(file))?;
        lines.extend(names_in(&page).into_iter().map(|inner| format!("  {name} {inner}")));
    }
    lines.sort();
    lines.dedup();
    // Names stand below their item.
    let name = |line: &String| {
        line.trim_start().split(' ').nth(usize::from(!line.starts_with(' '))).map(str::to_owned)
    };
    lines.sort_by_key(name);
    Ok(lines.join("\n") + "\n")
}

/// The part of a page before the traits that its item implements.
fn own(page: &str) -> &str {
    let ends = ["deref-methods", "trait-implementations", "synthetic-implementations", "implementors"];
    let end = ends.iter().filter_map(|end| page.find(&format!("id=\"{end}"))).min();
    &page[..end.unwrap_or(page.len())]
}

/// Names that an item declares itself, without those of the traits that it implements.
fn names_in(page: &str) -> Vec<String> {
    let ids = own(page).split(" id=\"").skip(1).filter_map(|rest| rest.split_once('"').map(|(id, _)| id));
    let is_name = |id: &&str| id.split_once('.').is_some_and(|(kind, _)| KINDS.contains(&kind));
    let mut names: Vec<String> = ids.filter(is_name).map(str::to_owned).collect();
    names.sort();
    names.dedup();
    names
}

/// A type in a signature or a field that has no page of its own, and the file that shows it.
fn unnamed(folder: &Path) -> std::io::Result<Option<(PathBuf, String)>> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let found = match path.is_dir() {
            true => unnamed(&path)?,
            false => unlinked_type(&fs::read_to_string(&path)?).map(|name| (path, name)),
        };
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

/// A type without a link among the arguments, results and fields that an item declares itself.
fn unlinked_type(page: &str) -> Option<String> {
    let methods = own(page).split("<h4 class=\"code-header\">").skip(1).filter_map(|rest| {
        let (signature, _) = rest.split_once("</h4>")?;
        signature.split_once("</a>(").or_else(|| signature.split_once("</a>&lt;"))
    });
    let fields = own(page).split("<span id=\"structfield.").skip(1).filter_map(|rest| {
        let (_, code) = rest.split_once("<code>")?;
        code.split_once("</code>")?.0.split_once(": ")
    });
    methods.chain(fields).find_map(|(_, types)| {
        // Text outside of links and tags.
        let plain: String = types
            .split("<a ")
            .enumerate()
            .map(|(i, part)| if i == 0 { part } else { part.split_once("</a>").map_or("", |(_, text)| text) })
            .collect();
        let texts = plain.split('<').map(|part| part.split_once('>').map_or(part, |(_, text)| text));
        let words = texts.flat_map(|text| text.split(|letter: char| !letter.is_alphanumeric()));
        let is_type = |word: &&str| {
            word.starts_with(char::is_uppercase)
                && word.contains(char::is_lowercase)
                && !FOREIGN.contains(word)
        };
        words.into_iter().find(is_type).map(str::to_owned)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_without_a_page_is_found() {
        let linked =
            "<h4 class=\"code-header\">pub fn <a href=\"#x\">at</a>(ray: &amp;<a href=\"r\">Ray</a>)</h4>";
        assert_eq!(unlinked_type(linked), None);
        let method = linked.replace("<a href=\"r\">Ray</a>", "Ray");
        assert_eq!(unlinked_type(&method).as_deref(), Some("Ray"));
        let field = "<span id=\"structfield.f\"><code>f: [<a href=\"r\">Ray</a>; Count]</code>";
        assert_eq!(unlinked_type(field).as_deref(), Some("Count"));
    }

    #[test]
    fn names_of_an_item_end_before_the_traits_that_it_implements() {
        let page = "<section id=\"method.new\"><a id=\"variant.Size\"><h2 id=\"trait-implementations\">\
                    <section id=\"method.clone\">";
        assert_eq!(
            names_in(&page.replace("<a id", "<a x id").replace("<section id", "<section x id")),
            ["method.new", "variant.Size"]
        );
    }

    #[test]
    fn a_lost_name_is_found() {
        assert_eq!(lost("struct A\n  A method.new\n", "struct A\n"), ["  A method.new"]);
        assert!(lost("struct A\n", "struct A\nstruct B\n").is_empty());
    }
}
