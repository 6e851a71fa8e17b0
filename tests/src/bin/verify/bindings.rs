//! The interfaces of the core for C and for the web: built, called by programs of these languages.

use crate::command::{command, exists, output, run};
use crate::targets::cross_cargo;
use crate::{Failure, Outcome, Project};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Triple of WebAssembly.
const WEB: &str = "wasm32-unknown-unknown";

/// Compiles C programs against the library and runs them. The products are those of the main workspace.
pub(crate) fn c(project: &Project) -> Outcome {
    if !exists("cc") {
        return Err(Failure::Missing("no C compiler: apt-get install gcc".to_owned()));
    }
    let folder = project.root.join("core/bindings/c");
    test(project, &folder, "")?;
    Ok(format!("header, programs in C and C++, {}", installed(project, &folder)?))
}

/// Builds the library, which the tests link, and runs those whose names have `filter`.
fn test(project: &Project, folder: &Path, filter: &str) -> Result<(), Failure> {
    for line in
        ["cargo build --profile quick --locked --quiet", "cargo test --profile quick --locked --quiet"]
    {
        let filter = Some(filter).filter(|filter| !filter.is_empty() && line.contains("test"));
        run(command(folder, line).args(filter).env("CARGO_TARGET_DIR", project.root.join("target")))?;
    }
    Ok(())
}

/// Installs the library into an empty prefix, and runs a program that is compiled by its file for pkg-config.
fn installed(project: &Project, folder: &Path) -> Outcome {
    if !exists("cargo-cinstall") || !exists("pkg-config") {
        let advice = "cargo install cargo-c@0.10.24, apt-get install pkg-config";
        return Err(Failure::Missing(format!("all but the installed library passes: {advice}")));
    }
    let prefix = project.root.join("target/prefix");
    let _ = fs::remove_dir_all(&prefix);
    let mut cargo = command(folder, "cargo cinstall --profile quick --locked --libdir lib --prefix");
    run(cargo.arg(&prefix).env("CARGO_TARGET_DIR", project.root.join("target/cinstall")))?;
    let mut config = command(folder, "pkg-config --cflags --libs halflight");
    let flags = output(config.env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig")))?;
    let program = prefix.join("rays");
    let line = "cc -std=c99 -Wall -Wextra -Werror examples/rays.c -o";
    run(command(folder, line).arg(&program).args(flags.split_whitespace()))?;
    run(Command::new(&program).env("LD_LIBRARY_PATH", prefix.join("lib")))?;
    Ok("installed by cargo-c".to_owned())
}

/// Packages that check the types of the module and bundle its page.
const WEB_TOOLS: &str = "typescript@5.9.3 vite@7 three@0.187.0";

/// Builds the module for the web, and calls it under node, as a package, and in a browser.
pub(crate) fn web(project: &Project) -> Outcome {
    if !exists("node") {
        return Err(Failure::Missing("no node: apt-get install nodejs".to_owned()));
    }
    let folder = project.root.join("core/bindings/c");
    let mut cargo = cross_cargo(&folder, WEB)?;
    let line = "--profile web --locked --quiet --no-default-features --features small --target";
    run(cargo.args(line.split(' ')).arg(WEB).env("RUSTFLAGS", "-C target-feature=+simd128"))?;
    let io = |error: std::io::Error| Failure::Failed(format!("halflight.wasm: {error}"));
    let built = folder.join("target").join(WEB).join("web/halflight.wasm");
    let module = project.root.join("core/bindings/wasm/halflight.wasm");
    let bytes = fs::copy(built, &module).map_err(io)?;
    test(project, &folder, "web")?;
    package(project)?;
    let line =
        "cargo test --profile quick --locked --quiet -p halflight-tests --test main web_page:: -- --ignored";
    run(&mut command(&project.root, line))?;
    Ok(format!("{bytes} bytes: bits of the native library, its package and its page"))
}

/// Installs the packed module into an empty folder: its types hold, a program runs, and a bundler builds the
/// page.
fn package(project: &Project) -> Result<(), Failure> {
    let io = |error: std::io::Error| Failure::Failed(format!("the package for npm: {error}"));
    let source = project.root.join("core/bindings/wasm");
    let folder = project.root.join("target/npm");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(io)?;
    let archive = output(command(&source, "npm pack --silent --pack-destination").arg(&folder))?;
    fs::write(folder.join("package.json"), r#"{ "private": true, "type": "module" }"#).map_err(io)?;
    fs::copy(source.join("test/types.ts"), folder.join("types.ts")).map_err(io)?;
    let compiler = "node_modules/typescript/bin/tsc --strict --target es2022 --module nodenext";
    let page = "node_modules/vite/bin/vite.js build node_modules/halflight/page --logLevel error";
    for line in [
        format!("npm install --silent --no-audit --no-fund {WEB_TOOLS} ./{archive}"),
        format!("node {compiler} --lib es2022,dom types.ts"),
        "node types.js".to_owned(),
        format!("node {page} --target es2022 --emptyOutDir --outDir {}", folder.join("page").display()),
    ] {
        run(&mut command(&folder, &line))?;
    }
    Ok(())
}
