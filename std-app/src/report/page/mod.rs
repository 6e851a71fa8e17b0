//! Pages: templates that are read as HTML, filled with what was measured. Whatever comes from outside (names of
//! scenes and files, repairs, the command) passes through [`escape`].

mod audit;
mod cache;
mod chart;
mod error;
mod map;
mod parts;
mod photons;
mod picture;
mod race;
mod run;

pub(super) use race::page as race;
pub(super) use run::page as run;

/// A whole page around `body`. All is HTML but `title`.
fn shell(title: &str, body: &str) -> String {
    fill(
        include_str!("shell.html"),
        &[
            ("title", &escape(title)),
            ("style", include_str!("style.css")),
            ("script", include_str!("script.js")),
            ("body", body),
        ],
    )
}

/// `template` with each `{{name}}` replaced by its value; what is not given becomes nothing. Values are not looked
/// into.
fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut parts = template.split("{{");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or(("", part));
        let value = values.iter().find(|(known, _)| *known == name);
        debug_assert!(value.is_some(), "{name} has no value");
        text += value.map_or("", |(_, value)| value);
        text += rest;
    }
    text
}

/// Text as HTML shows it, in elements and in quoted attributes.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            // Of no meaning in text, and not allowed in HTML.
            c if c.is_control() && !"\n\t".contains(c) => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_not_looked_into() {
        assert_eq!(fill("{{a}} and {{b}}.", &[("a", "{{b}}"), ("b", "x")]), "{{b}} and x.");
    }

    #[test]
    fn what_comes_from_outside_stays_text() {
        assert_eq!(
            escape("<img src=\"x\" onerror='y'>&\u{1}"),
            "&lt;img src=&quot;x&quot; onerror=&#39;y&#39;&gt;&amp;\u{fffd}"
        );
    }
}
