//! Format, lints, tests and documentation, through cargo.

use crate::command::{command, run};
use crate::{Outcome, Project};

/// Folders with a workspace of their own.
const WORKSPACES: &[&str] = &[".", "tests/targets", "fuzz"];

/// What clippy looks at: folder, and what is built there.
const CLIPPY: &[(&str, &str)] = &[
    (".", "--workspace --all-targets"),
    // Without the default features: what a microcontroller gets.
    (".", "-p halflight-core -p halflight-simd --lib"),
    ("tests/targets", "-p tiny -p host"),
    ("fuzz", "--no-default-features --features app --lib --bins"),
];

pub(crate) fn fmt(project: &Project) -> Outcome {
    for folder in WORKSPACES {
        run(&mut command(&project.root.join(folder), "cargo fmt --all --check"))?;
    }
    Ok(format!("{} workspaces", WORKSPACES.len()))
}

pub(crate) fn clippy(project: &Project) -> Outcome {
    for (folder, what) in CLIPPY {
        let line = format!("cargo clippy --quiet --locked {what} -- -D warnings");
        run(&mut command(&project.root.join(folder), &line))?;
    }
    Ok(format!("{} selections", CLIPPY.len()))
}

pub(crate) fn test(project: &Project) -> Outcome {
    run(&mut command(&project.root, "cargo test --release --workspace --locked"))?;
    Ok("all passed".to_owned())
}

pub(crate) fn docs(project: &Project) -> Outcome {
    let line = "cargo doc --quiet --workspace --no-deps --document-private-items --locked";
    // Links to private modules are for those who read the code, and work in these pages.
    let flags = "-D warnings -A rustdoc::private_intra_doc_links";
    run(command(&project.root, line).env("RUSTDOCFLAGS", flags))?;
    Ok("no warnings".to_owned())
}
