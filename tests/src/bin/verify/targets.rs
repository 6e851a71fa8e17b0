//! The small programs (`tiny_render.rs` and `tiny_parts.rs` of `core/examples`) on every constrained target:
//! they must build, and where they can run their bits must equal those of the ordinary examples.

use crate::command::{command, exists, fresh_cargo, in_pairs, output, run};
use crate::{Failure, Outcome, Project};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// One build of the tiny render.
struct Build {
    name: &'static str,
    /// Package of the workspace `tests/targets`.
    package: &'static str,
    triple: &'static str,
    features: &'static str,
    /// `release` has link-time optimisation, without which the program is too large for the board.
    profile: &'static str,
    run: Run,
    /// WebAssembly: whether the module must contain SIMD instructions (`true`) or must not (`false`).
    simd: Option<bool>,
}

/// Ways to run a build.
enum Run {
    /// On this machine.
    Here,
    /// Under node.
    Node,
    /// Under QEMU if installed; otherwise linking suffices.
    Board,
}

// The longest build comes first.
const BUILDS: &[Build] = &[
    Build {
        name: "Cortex-M4F",
        package: "cortexm",
        triple: "thumbv7em-none-eabihf",
        features: "",
        profile: "release",
        run: Run::Board,
        simd: None,
    },
    Build {
        name: "x86-64, neither std nor libc",
        package: "host",
        triple: "x86_64-unknown-linux-gnu",
        features: "",
        profile: "quick",
        run: Run::Here,
        simd: None,
    },
    Build {
        name: "wasm32",
        package: "wasm",
        triple: "wasm32-unknown-unknown",
        features: "",
        profile: "quick",
        run: Run::Node,
        simd: Some(false),
    },
    Build {
        name: "wasm32 with simd128",
        package: "wasm",
        triple: "wasm32-unknown-unknown",
        features: "+simd128",
        profile: "quick",
        run: Run::Node,
        simd: Some(true),
    },
];

pub(crate) fn check(project: &Project) -> Outcome {
    // The whole workspace: with the features of the tests, whose products it shares.
    let examples =
        "cargo build --profile quick --quiet --locked --workspace --example tiny_render --example tiny_parts";
    run(&mut command(&project.root, examples))?;
    let examples = std::env::current_exe().unwrap_or_default().with_file_name("examples");
    let [pictures, parts] =
        ["tiny_render", "tiny_parts"].map(|name| output(&mut Command::new(examples.join(name))));
    let [pictures, parts] = [pictures?, parts?];
    println!("{pictures}\n{parts}");
    // A fingerprint follows each picture and each part.
    let is_fingerprint = |line: &&str| line.len() == 16 && line.bytes().all(|byte| byte.is_ascii_hexdigit());
    let expected = [&pictures, &parts].map(|text| text.lines().filter(is_fingerprint).collect::<Vec<_>>());

    // All builds are tried, so that a missing tool hides no failure.
    let results: Vec<_> =
        BUILDS.iter().zip(in_pairs(BUILDS, |build| one(project, build, &expected))).collect();
    for (build, result) in &results {
        let text = match result {
            Ok(text) | Err(Failure::Missing(text)) | Err(Failure::Failed(text)) => text,
        };
        println!("  {:<30} {text}", build.name);
    }
    let failed = |result: &Outcome| matches!(result, Err(Failure::Failed(_)));
    let mut errors: Vec<_> = results.into_iter().filter(|(_, result)| result.is_err()).collect();
    errors.sort_by_key(|(_, result)| !failed(result));
    match errors.into_iter().next() {
        Some((_, error)) => error,
        None => {
            let [pictures, parts] = expected.map(|lines| lines.len());
            Ok(format!(
                "{} builds and the examples agree on {pictures} pictures and {parts} parts",
                BUILDS.len()
            ))
        }
    }
}

/// Fingerprint of a method that lacks memory.
const ZEROS: &str = "0000000000000000";

/// Builds, runs and compares one build.
fn one(project: &Project, build: &Build, [pictures, parts]: &[Vec<&str>; 2]) -> Outcome {
    let folder = project.root.join("tests/targets");
    let target = folder.join("target").join(format!("{}{}", build.package, build.features.replace('+', "-")));
    let mut cargo = match build.run {
        Run::Here if cfg!(all(target_arch = "x86_64", target_os = "linux")) => {
            command(&folder, "cargo build")
        }
        Run::Here => return Err(Failure::Missing("needs an x86-64 machine with Linux".to_owned())),
        _ => cross_cargo(&folder, build.triple)?,
    };
    cargo.args(["--profile", build.profile, "--quiet", "--locked"]);
    cargo.args(["--package", build.package, "--target", build.triple]);
    cargo.arg("--target-dir").arg(&target);
    if !build.features.is_empty() {
        cargo.env("RUSTFLAGS", format!("-Ctarget-feature={}", build.features));
    }
    run(&mut cargo)?;

    let products = target.join(build.triple).join(build.profile);
    let (file, seen) = match build.run {
        Run::Here => (products.join(build.package), output(&mut Command::new(products.join(build.package)))?),
        Run::Node => {
            let module = products.join(format!("{}.wasm", build.package));
            let mut node = command(&folder, "node wasm/run.mjs");
            let seen = output(node.arg(&module))?;
            (module, seen)
        }
        Run::Board => {
            let program = products.join(build.package);
            if !exists("qemu-system-arm") {
                return Ok(format!("links ({}); no qemu-system-arm here to run it", size(&program)));
            }
            let line = "qemu-system-arm -M mps2-an386 -display none -monitor none -serial none \
                        -chardev stdio,id=host -semihosting-config enable=on,target=native,chardev=host -kernel";
            let seen = output(command(&folder, line).arg(&program))?;
            (program, seen)
        }
    };
    if let Some(simd) = build.simd {
        instructions_as_promised(&file, simd)?;
    }
    // Methods that do not fit into the board's memory give zeros there; each part fits.
    let is_short = |line: &str| matches!(build.run, Run::Board) && line == ZEROS;
    let lines: Vec<&str> = seen.lines().collect();
    let (of_pictures, of_parts) = lines.split_at(lines.len().min(pictures.len()));
    let is_same = of_parts == parts.as_slice()
        && of_pictures.iter().zip(pictures).all(|(line, expected)| line == expected || is_short(line));
    let fitting = of_pictures.iter().filter(|line| !is_short(line)).count();
    let size = size(&file);
    match is_same {
        true => Ok(format!("{fitting} of {} methods, {} parts ({size})", pictures.len(), parts.len())),
        false => Err(Failure::Failed(format!("{}: {lines:?}, not {pictures:?} {parts:?}", build.name))),
    }
}

/// A cargo that builds for `triple`: rustup's if it has the target, else Debian's compiler with the source of
/// `core` (packages rustc-web, cargo-web, rust-web-src) and rustup's linker.
pub(crate) fn cross_cargo(folder: &Path, triple: &str) -> Result<Command, Failure> {
    let libraries = output(command(folder, "rustc --print target-libdir --target").arg(triple))?;
    if Path::new(&libraries).exists() {
        return Ok(command(folder, "cargo build"));
    }
    let debian = ["/usr/bin/rustc", "/usr/bin/cargo", "/usr/lib/rustlib/src/rust/library/core/src/lib.rs"];
    if let Some(absent) = debian.iter().find(|path| !Path::new(path).exists()) {
        let advice =
            format!("rustup target add {triple}, or apt-get install rustc-web cargo-web rust-web-src");
        return Err(Failure::Missing(format!("{absent} is not there: {advice}")));
    }
    let sysroot = PathBuf::from(output(&mut command(folder, "rustc --print sysroot"))?);
    let linker = sysroot.join("lib/rustlib/x86_64-unknown-linux-gnu/bin/rust-lld");
    let mut cargo = fresh_cargo(folder, "/usr/bin/cargo build -Zbuild-std=core");
    cargo.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1");
    for name in ["THUMBV7EM_NONE_EABIHF", "WASM32_UNKNOWN_UNKNOWN"] {
        cargo.env(format!("CARGO_TARGET_{name}_LINKER"), &linker);
    }
    Ok(cargo)
}

/// A module without simd128 must be valid for a parser without SIMD; a module with simd128 must be invalid
/// for it.
fn instructions_as_promised(module: &Path, simd: bool) -> Result<(), Failure> {
    let failed = |text: String| Failure::Failed(format!("{}: {text}", module.display()));
    let bytes = fs::read(module).map_err(|error| failed(error.to_string()))?;
    let features = wasmparser::WasmFeatures::default().difference(wasmparser::WasmFeatures::SIMD);
    let plain = wasmparser::Validator::new_with_features(features).validate_all(&bytes);
    match (plain, simd) {
        (Ok(_), true) => Err(failed("no SIMD instruction in a build that asks for them".to_owned())),
        (Err(error), false) => Err(failed(format!("not plain WebAssembly: {error}"))),
        _ => Ok(()),
    }
}

fn size(path: &Path) -> String {
    fs::metadata(path).map_or(String::new(), |file| format!("{} bytes", file.len()))
}
