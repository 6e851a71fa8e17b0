//! The Python package: its wheel, in a fresh environment, passes pytest.

use crate::command::{command, fresh_cargo, output, run};
use crate::{Failure, Outcome, Project};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread;

/// The package.
const PACKAGE: &str = "std-app/bindings/python";

/// Largest wheel in bytes.
const MAX_WHEEL: u64 = 6 << 20;

/// Packages of the environment that the build needs: the builder, and an installer that is quicker than pip.
const BUILDERS: &str = "maturin>=1.9,<2 uv";

/// Packages of the tests and notebooks.
const TOOLS: &str = "numpy pytest mypy nbclient ipykernel matplotlib pyradiance pyoidn";

/// Builds the wheel and runs pytest. The package shares the folder of products with the root workspace.
pub(crate) fn check(project: &Project) -> Outcome {
    let mut probe = command(&project.root, "python3 -c");
    let probe = probe.arg("import venv, ensurepip").stderr(Stdio::null());
    if !probe.status().is_ok_and(|status| status.success()) {
        let text = "python3 with venv: install the packages python3 and python3-venv";
        return Err(Failure::Missing(text.to_owned()));
    }
    let package = project.root.join(PACKAGE);
    let target = project.root.join("target");
    let (venv, wheels) = (target.join("python/venv"), target.join("python/wheels"));
    for folder in [&venv, &wheels] {
        let _ = fs::remove_dir_all(folder);
    }
    let venv_path = venv.to_string_lossy();
    run(command(&package, "python3 -m venv").arg(&*venv_path))?;
    let tool = |name: &str| venv.join("bin").join(name).to_string_lossy().into_owned();
    let pip = format!("{} -m pip install --quiet --disable-pip-version-check", tool("python"));
    run(command(&package, &pip).args(BUILDERS.split(' ')))?;
    let install = |what: &[String]| {
        let uv = format!("{} pip install --quiet --python {}", tool("uv"), tool("python"));
        run(command(&package, &uv).args(what))
    };
    let build = || {
        run(&mut command(&package, "cargo clippy --quiet --locked --profile quick -- -D warnings"))?;
        let maturin = tool("maturin");
        let line = format!("{maturin} build --quiet --profile quick --locked --compression-level 9 --out");
        run(fresh_cargo(&package, &line).arg(&wheels))
    };
    // The network and the compiler work at the same time.
    let tools: Vec<_> = TOOLS.split(' ').map(str::to_owned).collect();
    thread::scope(|scope| {
        let installed = scope.spawn(|| install(&tools));
        build().and(installed.join().expect("the installation does not panic"))
    })?;
    let wheel = only_wheel(&wheels)?;
    let bytes = fs::metadata(&wheel).map_or(0, |wheel| wheel.len());
    if bytes > MAX_WHEEL {
        return Err(Failure::Failed(format!("the wheel has {bytes} bytes, {MAX_WHEEL} at most")));
    }
    install(&[wheel.to_string_lossy().into_owned()])?;
    let tests = format!("{} -m pytest -q -p no:cacheprovider", tool("python"));
    run(&mut command(&package, &tests))?;
    let version = output(&mut command(&package, &format!("{} --version", tool("python"))))?;
    Ok(format!("{version}, a wheel of {:.1} MB", bytes as f64 / 1e6))
}

/// The wheel in `folder`.
fn only_wheel(folder: &Path) -> Result<PathBuf, Failure> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut wheels = entries.filter(|path| path.extension().is_some_and(|extension| extension == "whl"));
    wheels.next().ok_or_else(|| Failure::Failed(format!("no wheel in {}", folder.display())))
}
