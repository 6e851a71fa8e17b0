//! Format, lints, tests and documentation, by cargo.

use crate::command::{command, run, run_with_report};
use crate::{Outcome, Project};

/// Directories with their own workspace.
const WORKSPACES: &[&str] = &[".", "tests/targets", "fuzz", "core/bindings/c", "std-app/bindings/python"];

/// Clippy selections: directory and arguments. All use the profile and the products of tests, to share
/// compiled macros, build scripts and checked dependencies.
const CLIPPY: &[(&str, &str)] = &[
    (".", "--workspace --all-targets"),
    // Without default features, as a microcontroller builds it.
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
        let line = format!("cargo clippy --profile quick --quiet --locked {what} -- -D warnings");
        let mut cargo = command(&project.root.join(folder), &line);
        run(cargo.env("CARGO_TARGET_DIR", project.root.join("target")))?;
    }
    Ok(format!("{} selections", CLIPPY.len()))
}

pub(crate) fn test(project: &Project) -> Outcome {
    let line = "cargo test --profile quick --workspace --locked --no-fail-fast";
    // libtest prints messages and names of failed tests between these lines.
    run_with_report(&mut command(&project.root, line), "failures:", "test result:")?;
    Ok("all passed".to_owned())
}

pub(crate) fn unit(project: &Project) -> Outcome {
    let line = "cargo test --profile quick --locked --quiet -p halflight-core -p halflight-simd --lib";
    run(&mut command(&project.root, line))?;
    Ok("all passed".to_owned())
}

pub(crate) fn table(project: &Project) -> Outcome {
    let line = "cargo test --profile quick --locked --quiet -p halflight-tests --test main table::";
    run(command(&project.root, line).env("TABLE", "small"))?;
    Ok("all passed".to_owned())
}

pub(crate) fn docs(project: &Project) -> Outcome {
    let line = "cargo doc --profile quick --quiet --workspace --no-deps --document-private-items --locked";
    // Links to private modules are for readers of the code, and work in these pages.
    let flags = "-D warnings -A rustdoc::private_intra_doc_links";
    run(command(&project.root, line).env("RUSTDOCFLAGS", flags))?;
    Ok("no warnings".to_owned())
}
