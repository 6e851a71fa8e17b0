//! The manual page `man/halflight.3`, made of the header.

use super::{assert_file, folder, read};
use std::fmt::Write;

/// Text of troff: a line must not begin with a control character, and backslashes and hyphens are letters.
fn plain(text: &str) -> String {
    text.replace('\\', "\\e").replace('-', "\\-").replace("\n.", "\n\\&.").replace('`', "")
}

#[test]
fn the_manual_page_is_that_of_the_header() {
    let header = read(&folder().join("include/halflight.h"));
    let (about, rest) = header.split_once("*/").unwrap();
    let about = about.trim_start_matches("/* ").replace("\n *", "\n").replace("\n ", "\n");
    let (title, about) = about.split_once("\n\n").unwrap();
    let (name, what) = title.split_once(": ").unwrap();
    let mut page = format!(".TH HALFLIGHT 3 \"\" \"halflight {}\"\n", env!("CARGO_PKG_VERSION"));
    let about = about.rsplit_once(" Generated from").map_or(about, |(about, _)| about);
    let what = what.trim_end_matches('.');
    writeln!(page, ".SH NAME\n{name} \\- {}", plain(what)).unwrap();
    let build = plain("cc program.c $(pkg-config --cflags --libs halflight)");
    writeln!(page, ".SH SYNOPSIS\n.B #include <halflight.h>\n.PP\n{build}").unwrap();
    writeln!(page, ".SH DESCRIPTION\n{}", plain(about.trim())).unwrap();
    let (mut text, mut code) = (String::new(), String::new());
    for (title, is_function) in [("CONSTANTS AND STRUCTURES", false), ("FUNCTIONS", true)] {
        writeln!(page, ".SH {title}").unwrap();
        let parts = rest.split("#ifdef __cplusplus").nth(usize::from(is_function)).unwrap_or_default();
        for block in parts.split("\n\n") {
            for line in block.lines().filter(|line| !line.starts_with("#if") && !line.starts_with("#inc")) {
                match line.strip_prefix("//") {
                    Some(comment) => text = text + comment.trim() + "\n",
                    None => code = code + line + "\n",
                }
            }
            if !text.is_empty() && !code.is_empty() {
                let (text, code) = (plain(text.trim_end()), plain(code.trim_end()));
                writeln!(page, ".PP\n.nf\n.ft B\n{code}\n.ft R\n.fi\n.RS\n{text}\n.RE").unwrap();
            }
            text.clear();
            code.clear();
        }
    }
    assert_file("man/halflight.3", &page);
}
