//! The binary interface: symbols, prototypes, constants, and offsets of structures, beside those of the
//! last release in `abi.txt`.

use super::{C, compiled_from, folder, libraries, lines_of, read};
use std::fmt::Write;
use std::process::Command;

/// Statements of the header without comments, each in one line: `#define`s, then what ends in a semicolon.
fn statements() -> Vec<String> {
    let header = read(&folder().join("include/halflight.h"));
    let header = header.split_once("*/").map_or("", |(_, rest)| rest).replace("extern \"C\" {", "");
    let (mut lines, mut code) = (Vec::new(), String::new());
    for line in header.lines().map(|line| line.split("//").next().unwrap_or_default().trim()) {
        match line.strip_prefix('#') {
            Some(directive) if directive.starts_with("define HALFLIGHT_") => lines.push(directive.to_owned()),
            Some(_) => {}
            None => code = code + line + " ",
        }
    }
    let (mut depth, mut statement) = (0, String::new());
    for letter in code.chars() {
        depth += i32::from(letter == '{') - i32::from(letter == '}');
        statement.push(letter);
        if depth == 0 && letter == ';' {
            let words: Vec<&str> = statement.split_whitespace().collect();
            lines.push(words.join(" "));
            statement.clear();
        }
    }
    lines
}

/// Name and fields of a structure, with the name of each field.
fn structure(statement: &str) -> Option<(&str, Vec<&str>)> {
    let (fields, name) = statement.strip_prefix("typedef struct { ")?.rsplit_once("} ")?;
    // `void (*run)(…)` is the field `run`; `float eye[3]` the field `eye`.
    let name_of = |field: &'_ str| -> Option<(usize, usize)> {
        let start =
            field.find("(*").map_or_else(|| field.rfind([' ', '*']).map(|at| at + 1), |at| Some(at + 2))?;
        let length = field[start..].find([')', '[']).unwrap_or(field.len() - start);
        Some((start, length))
    };
    let fields = fields.split(';').map(str::trim).filter(|field| !field.is_empty());
    let names =
        fields.filter_map(|field| name_of(field).map(|(start, length)| &field[start..start + length]));
    Some((name.trim_end_matches(';'), names.collect()))
}

/// The interface: a line for each constant, prototype, and field with its offset and size.
fn interface() -> Vec<String> {
    let statements = statements();
    let mut program = "#include <halflight.h>\n#include <stdio.h>\nint main(void) {\n".to_owned();
    let mut lines: Vec<String> = Vec::new();
    for statement in &statements {
        let Some((name, fields)) = structure(statement) else {
            // Structures without fields and guards of the header are no part of it.
            let is_opaque = statement.starts_with("typedef struct ") || statement == "define HALFLIGHT_H";
            lines.extend((!is_opaque).then(|| statement.clone()));
            continue;
        };
        writeln!(program, "printf(\"{name}: %d bytes\\n\", (int)sizeof({name}));").unwrap();
        for field in fields {
            let size = format!("(int)offsetof({name}, {field}), (int)sizeof((({name} *)0)->{field})");
            writeln!(program, "printf(\"{name}.{field}: %d, %d bytes\\n\", {size});").unwrap();
        }
    }
    let file = libraries().join("deps/abi.c");
    std::fs::write(&file, program + "return 0;\n}\n").unwrap();
    lines.extend(lines_of(&mut Command::new(compiled_from(&file, "abi", &C, false))));
    lines
}

#[test]
fn the_interface_is_that_of_the_last_release() {
    let interface = interface();
    assert!(interface.len() > 100, "{} lines", interface.len());
    let released = read(&folder().join("abi.txt"));
    // Programs of the last release call what is gone; what is new waits for the next.
    let gone: Vec<&str> =
        released.lines().filter(|line| !interface.iter().any(|other| other == line)).collect();
    if std::env::var("SNAPSHOT").is_ok_and(|write| write == "release") {
        std::fs::write(folder().join("abi.txt"), interface.join("\n") + "\n").unwrap();
        return;
    }
    assert!(
        !released.is_empty() && gone.is_empty(),
        "gone: {gone:#?}; SNAPSHOT=release records a new release"
    );
}

#[test]
fn the_shared_library_has_the_functions_of_the_header_alone() {
    let library = libraries().join("libhalflight.so");
    let lines = lines_of(Command::new("nm").args(["-D", "--defined-only", "--format=posix"]).arg(library));
    let mut symbols: Vec<&str> = lines.iter().filter_map(|line| line.split(' ').next()).collect();
    let statements = statements();
    let name = |statement: &'_ str| {
        let start = statement.find("halflight_")?;
        Some((start, start + statement[start..].find('(')?))
    };
    let functions = statements.iter().filter(|statement| !statement.starts_with("typedef"));
    let mut functions: Vec<&str> =
        functions.filter_map(|of| name(of).map(|(start, end)| &of[start..end])).collect();
    symbols.sort();
    functions.sort();
    assert!(functions.len() > 20);
    assert_eq!(symbols, functions);
}
