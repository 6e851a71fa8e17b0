//! The page: a static document with one style sheet and one script. Rust adds data alone: the object of
//! `run.json`, and the values of the pixels.

use super::layers::Layer;
use serde::Serialize;
use serde_json::Value;

/// Document with marks in double braces.
const DOCUMENT: &str = include_str!("page/page.html");

const STYLE: &str = include_str!("page/style.css");

/// The script, whose parts share one scope.
const SCRIPT: &str = concat!(
    include_str!("page/text.js"),
    include_str!("page/chart.js"),
    include_str!("page/layers.js"),
    include_str!("page/views.js"),
    include_str!("page/viewer.js"),
    include_str!("page/sections.js"),
);

/// Page of a render or a race.
pub(super) fn page(object: &Value, layers: &[Layer]) -> String {
    let (object, layers) = (embedded(object), embedded(&layers));
    let parts =
        [("{{style}}", STYLE), ("{{object}}", &object), ("{{layers}}", &layers), ("{{script}}", SCRIPT)];
    let mut page = String::new();
    let mut rest = DOCUMENT;
    for (mark, part) in parts {
        let (before, after) = rest.split_once(mark).unwrap_or((rest, ""));
        page.extend([before, part]);
        rest = after;
    }
    page + rest
}

/// JSON that cannot end a script element: names of a scene may hold `</script>`.
fn embedded(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default().replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_their_script_element() {
        let name = "</script><script>alert(1)</script><!--{{layers}}";
        let page = page(&Value::from(name), &[]);
        assert!(page.starts_with("<!doctype html>\n") && page.ends_with("</html>\n"));
        assert!(!page.contains("alert(1)</script>") && page.contains("\\u003c/script>"), "{page}");
        assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
        assert_eq!(page.matches("{{").count(), 1, "a mark in a name is text");
    }
}
