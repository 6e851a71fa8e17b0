//! Identifiers that are banned: words of conversation, which say nothing in the field.

/// Words that no identifier of code may be.
const BANNED: &[&str] = &["look", "ask", "tell", "say", "worth"];

/// A complaint for each banned identifier of a file.
pub(crate) fn check(name: &str, text: &str) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut is_string = false;
    for (index, line) in text.lines().enumerate() {
        let code = code(line, &mut is_string);
        let names = code.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        complaints.extend(
            names.filter(|word| BANNED.contains(word)).map(|word| {
                format!("{name}:{}: `{word}` is no word of the field (CONTRIBUTING.md)", index + 1)
            }),
        );
    }
    complaints
}

/// The line without comments and strings. A string may begin on a line before, as `is_string` says.
fn code(line: &str, is_string: &mut bool) -> String {
    let (mut code, mut last) = (String::new(), ' ');
    let line = line.replace("'\"'", "").replace("\\\\", "");
    let comment = if *is_string { None } else { line.find("//") };
    for (index, c) in line.char_indices() {
        if !*is_string && comment == Some(index) {
            break;
        }
        match c {
            '"' if last != '\\' => *is_string = !*is_string,
            _ if !*is_string => code.push(c),
            _ => {}
        }
        last = c;
    }
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn banned_words_are_whole_identifiers_outside_of_strings_and_comments() {
        let text =
            "fn look(&self) {\n    let look_at = \"tell\"; // Ask.\n    a(\"say\n    say\"); ask('\"');\n";
        let complaints = check("a.rs", text);
        assert_eq!(complaints.len(), 2, "{complaints:?}");
        assert!(complaints[0].starts_with("a.rs:1: `look`") && complaints[1].starts_with("a.rs:4: `ask`"));
    }
}
