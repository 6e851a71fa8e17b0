//! Report pages as HTML, whose text `maud` escapes.

mod audit;
mod cache_survey;
mod chart;
mod error;
mod map;
mod parts;
mod photon_maps;
mod picture;
mod race;
mod run;

pub(super) use race::page as race;
pub(super) use run::page as run;

use maud::{Markup, PreEscaped, html};

/// Content of the page that loads nothing: pictures are data, style and script are inline.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// Whole document with a heading, an introduction and the sections `main`.
fn document(heading: &str, introduction: Option<Markup>, main: &Markup) -> String {
    let document = html! {
        (PreEscaped("<!doctype html>\n"))
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                title { (heading) " – halflight" }
                link rel="icon" href="data:,";
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                header {
                    p.brand { "halflight" }
                    h1 { (heading) }
                    @if let Some(text) = introduction { p.lead { (text) } }
                }
                main { (main) }
                footer { "All numbers are in " code { "run.json" } " and " code { "curve.csv" } "." }
                script { (PreEscaped(include_str!("script.js"))) }
            }
        }
        "\n"
    };
    document.into_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped() {
        let page = document("<img src=\"x\">&", None, &html! {});
        assert!(page.contains("<h1>&lt;img src=&quot;x&quot;&gt;&amp;</h1>"), "{page}");
        assert!(page.starts_with("<!doctype html>\n") && page.ends_with("</html>\n"));
    }
}
