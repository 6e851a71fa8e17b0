//! The published crates: packed without a warning, tested in empty folders, built with each feature alone, by
//! the oldest compiler and with the oldest dependencies that their manifests allow.

use crate::command::{command, fresh_cargo, output, run};
use crate::{Failure, Outcome, Project, doors};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The published crates, each after those that it depends on.
const CRATES: [&str; 4] = ["halflight-test-support", "halflight-simd", "halflight-core", "halflight"];

/// Features of the library, each of which compiles alone.
const FEATURES: [&str; 6] = ["cli", "report", "gltf", "tev", "formats", "sky"];

/// Most crates of the library without features, itself included.
const MOST_CRATES: usize = 60;

/// The one warning of a dry run that is its purpose.
const DRY: &str = "aborting upload due to dry run";

pub(crate) fn check(project: &Project) -> Outcome {
    let version = oldest_compiler(project)?;
    let crates = features(project)?;
    docs(project)?;
    let bytes = pack(project)?;
    // Folders below the root would belong to its workspace.
    let unpacked = std::env::temp_dir().join("halflight-packages");
    for (folder, is_tested) in [(unpacked.join("tested"), true), (unpacked.join("oldest"), false)] {
        let config = unpack(project, &folder)?;
        if is_tested { test(project, &folder, &config)? } else { oldest_versions(project, &folder, &config)? }
    }
    // No release is in a registry: the checked-in list of names is the baseline of the promise.
    let names = doors::check(project)?;
    Ok(format!(
        "{} crates of {bytes} bytes, {crates} crates without features, Rust {version}, names: {names}",
        CRATES.len()
    ))
}

/// The oldest Rust that the manifests promise, which must be the one in use.
fn oldest_compiler(project: &Project) -> Result<String, Failure> {
    let manifest = read(&project.root.join("Cargo.toml"))?;
    let version = manifest.split("rust-version = \"").nth(1).and_then(|rest| rest.split('"').next());
    let version = version.unwrap_or_default().to_owned();
    let used = output(&mut command(&project.root, "rustc --version"))?;
    match used.strip_prefix(&format!("rustc {version}.")) {
        Some(_) => Ok(version),
        None => Err(Failure::Missing(format!(
            "{used} runs, and the manifests promise {version}: rustup run {version} cargo verify package"
        ))),
    }
}

/// The library without features, with each alone and with all; the number of crates without them.
fn features(project: &Project) -> Result<usize, Failure> {
    let line = "cargo clippy --profile quick --quiet --locked -p halflight --lib --no-default-features";
    run(command(&project.root, line).args(["--", "-D", "warnings"]))?;
    for feature in FEATURES {
        run(command(&project.root, line).args(["--features", feature, "--", "-D", "warnings"]))?;
    }
    let line = "cargo tree --locked -p halflight -e normal --no-default-features --prefix none";
    let tree = output(&mut command(&project.root, line))?;
    let name = |line: &'_ str| line.split(' ').take(2).collect::<Vec<_>>().join(" ");
    let crates: BTreeSet<String> = tree.lines().map(name).collect();
    match crates.len() {
        count if count <= MOST_CRATES => Ok(count),
        count => Err(Failure::Failed(format!("{count} crates without features, {MOST_CRATES} at most"))),
    }
}

/// Documentation with all features.
fn docs(project: &Project) -> Result<(), Failure> {
    let line = "cargo doc --profile quick --quiet --locked --no-deps --all-features";
    let mut cargo = command(&project.root, line);
    let flags = "-D warnings --cfg docsrs -A rustdoc::private_intra_doc_links";
    run(cargo.args(CRATES.iter().flat_map(|name| ["-p", name])).env("RUSTDOCFLAGS", flags))
}

/// Packs all crates; the bytes of the packages.
fn pack(project: &Project) -> Result<u64, Failure> {
    let line = "cargo publish --workspace --dry-run --no-verify --allow-dirty --locked";
    println!("$ {line}");
    let mut cargo = command(&project.root, line);
    let done = cargo.stdin(Stdio::null()).output().map_err(|error| Failure::Missing(error.to_string()))?;
    let text = String::from_utf8_lossy(&done.stderr);
    print!("{text}");
    let warning = text.lines().find(|line| line.starts_with("warning") && !line.contains(DRY));
    match (done.status.success(), warning) {
        (true, None) => {}
        (true, Some(warning)) => return Err(Failure::Failed(format!("`{line}`: {warning}"))),
        (false, _) => return Err(Failure::Failed(format!("`{line}`: {}", done.status))),
    }
    let mut cargo = command(&project.root, "cargo package --no-verify --allow-dirty --locked --quiet");
    run(cargo.args(CRATES.iter().flat_map(|name| ["-p", name])))?;
    let size = |name: &&str| fs::metadata(package(project, name)).map_or(0, |file| file.len());
    Ok(CRATES.iter().map(size).sum())
}

/// The package of a crate.
fn package(project: &Project, name: &str) -> PathBuf {
    project.root.join(format!("target/package/{name}-{}.crate", env!("CARGO_PKG_VERSION")))
}

/// Unpacks all crates into an empty folder. Returns a configuration by which they replace those of the
/// registry, with the profiles of the workspace, so that products of dependencies are shared.
fn unpack(project: &Project, folder: &Path) -> Result<PathBuf, Failure> {
    let io = |error: std::io::Error| Failure::Failed(format!("{}: {error}", folder.display()));
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).map_err(io)?;
    let mut text = "[patch.crates-io]\n".to_owned();
    for name in CRATES {
        run(Command::new("tar").arg("-xzf").arg(package(project, name)).arg("-C").arg(folder))?;
        let unpacked = folder.join(name);
        fs::rename(folder.join(format!("{name}-{}", env!("CARGO_PKG_VERSION"))), &unpacked).map_err(io)?;
        text += &format!("{name} = {{ path = {:?} }}\n", unpacked);
    }
    let manifest = read(&project.root.join("Cargo.toml"))?;
    let profiles = manifest.split_inclusive("\n\n").filter(|part| part.contains("[profile."));
    let config = folder.join("config.toml");
    fs::write(&config, text + &profiles.collect::<String>()).map_err(io)?;
    Ok(config)
}

/// Runs the tests of each unpacked crate.
fn test(project: &Project, folder: &Path, config: &Path) -> Result<(), Failure> {
    for name in CRATES {
        let mut cargo = fresh_cargo(&folder.join(name), "cargo test --profile quick --quiet --config");
        run(cargo.arg(config).env("CARGO_TARGET_DIR", project.root.join("target")))?;
    }
    Ok(())
}

/// Compiles the library with the oldest versions that its manifest allows.
fn oldest_versions(project: &Project, folder: &Path, config: &Path) -> Result<(), Failure> {
    let line = "cargo check --profile quick --quiet --all-features -Zdirect-minimal-versions --config";
    let folder = folder.join("halflight");
    let _ = fs::remove_file(folder.join("Cargo.lock"));
    let mut cargo = fresh_cargo(&folder, line);
    let cargo = cargo.arg(config).env("RUSTC_BOOTSTRAP", "1");
    run(cargo.env("CARGO_TARGET_DIR", project.root.join("target/oldest")))
}

fn read(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|error| Failure::Failed(format!("{}: {error}", path.display())))
}
