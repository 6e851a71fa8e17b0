//! Programs in C and C++ that use the library by its header: they compile without a warning, print right
//! values, and pass sanitizers, and valgrind where that is installed.

use core::sync::atomic::{AtomicU32, Ordering};
use std::path::{Path, PathBuf};
use std::process::Command;

mod abi;
mod manual;

const EXAMPLES: [&str; 5] = ["rays", "nearest", "irradiance", "picture", "threads"];

/// The programs with known lines, and these lines.
const PROGRAMS: [(&str, &[&str]); 2] = [
    (
        "rays",
        &[
            "ray 0: triangle 1 at 2, occluded 1",
            "ray 1: triangle 0 at 2, occluded 1",
            "ray 2: nothing, occluded 0",
        ],
    ),
    // The points (4, 5, 9), (5, 5, 9) and (4, 6, 9) of the lattice.
    (
        "nearest",
        &[
            "point 954, squared distance 0.07",
            "point 955, squared distance 0.67",
            "point 964, squared distance 0.77",
            "moments 1.005 0.489 0.013",
        ],
    ),
];

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Folder of the libraries, which `cargo build` has made: two above that of the test.
fn libraries() -> PathBuf {
    std::env::current_exe().unwrap().ancestors().nth(2).unwrap().to_path_buf()
}

/// Compiles an example against the static or the shared library, and returns the program.
fn compiled(name: &str, compiler: &[&str], shared: bool) -> PathBuf {
    compiled_from(&folder().join("examples").join(format!("{name}.c")), name, compiler, shared)
}

/// Compiles the file of a program.
fn compiled_from(file: &Path, name: &str, compiler: &[&str], shared: bool) -> PathBuf {
    let library = libraries();
    // Tests compile at the same time.
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let program = library.join("deps").join(format!("{name}-{number}"));
    let mut command = Command::new(compiler[0]);
    command.args(&compiler[1..]).args(["-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-I"]);
    command.arg(folder().join("include")).arg("-o").arg(&program);
    command.arg(file).args(["-x", "none"]);
    match shared {
        true => command.arg(library.join("libhalflight.so")).arg(format!("-Wl,-rpath,{}", library.display())),
        false => command.arg(library.join("libhalflight.a")),
    };
    let output = command.args(["-lm", "-lpthread", "-ldl"]).output().expect("a C compiler");
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    program
}

fn lines_of(command: &mut Command) -> Vec<String> {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{command:?}: {text}{}", String::from_utf8_lossy(&output.stderr));
    text.lines().map(String::from).collect()
}

const C: [&str; 2] = ["cc", "-std=c99"];

/// Compilers of both languages; those that are not installed are left out.
const COMPILERS: [&[&str]; 4] = [
    &C,
    &["c++", "-std=c++20", "-x", "c++"],
    &["clang", "-std=c99"],
    &["clang++", "-std=c++20", "-x", "c++"],
];

fn is_installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

#[test]
fn programs_print_right_values_in_c_and_cpp_with_both_libraries() {
    for (name, expected) in PROGRAMS {
        for compiler in COMPILERS.into_iter().filter(|compiler| is_installed(compiler[0])) {
            for shared in [false, true] {
                let lines = lines_of(&mut Command::new(compiled(name, compiler, shared)));
                assert_eq!(lines, expected, "{compiler:?}");
            }
        }
    }
}

#[test]
fn examples_are_short() {
    for name in EXAMPLES {
        let lines = read(&folder().join("examples").join(format!("{name}.c"))).lines().count();
        assert!((1..=40).contains(&lines), "{name}: {lines} lines");
    }
}

/// Irradiance below a small lamp: its area, seen from the point, integrated by 512 x 512 midpoints.
fn irradiance_below_the_lamp(x: f64) -> f64 {
    let n = 512;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            // The square of (s, t) folded onto the triangle of the lamp.
            let (mut s, mut t) = ((i as f64 + 0.5) / n as f64, (j as f64 + 0.5) / n as f64);
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            let at = [-0.5 + s + 0.5 * t, 2.0, -0.5 + t];
            let d = [at[0] - x, at[1], at[2]];
            let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            sum += d[1] * d[1] / (squared * squared);
        }
    }
    10.0 * 0.5 * sum / (n * n) as f64
}

#[test]
fn irradiance_is_that_of_the_lamp_within_its_interval() {
    let lines = lines_of(&mut Command::new(compiled("irradiance", &C, false)));
    let numbers = |line: &str| -> Vec<f64> {
        line.split(|c: char| !(c.is_ascii_digit() || c == '.')).filter_map(|word| word.parse().ok()).collect()
    };
    for (line, x) in lines.iter().zip([0.0, 1.0]) {
        let [value, _, lower, upper, samples] = numbers(line)[..] else { panic!("{line}") };
        let exact = irradiance_below_the_lamp(x);
        // The interval of 95 % to its double: five standard errors.
        let (half, middle) = (1.3 * (upper - lower), 0.5 * (upper + lower));
        assert!((exact - middle).abs() <= half.max(1e-3) && samples >= 1024.0, "{line} {exact}");
        assert!((value / exact - 1.0).abs() < 0.02, "{line} {exact}");
    }
    assert!(lines[2].starts_with("0.000 W/m2"), "no light comes from below the floor: {}", lines[2]);
}

#[test]
fn each_method_renders_in_one_buffer_until_its_error_is_small() {
    let lines = lines_of(&mut Command::new(compiled("picture", &C, false)));
    assert_eq!(lines.len(), 12);
    for line in lines {
        let upper: f64 = line.rsplit(' ').next().unwrap().parse().unwrap();
        assert!(line.contains(": done, ") && upper > 0.0 && upper < 0.1, "{line}");
    }
}

#[test]
fn threads_of_the_program_give_the_same_bits() {
    let lines = lines_of(&mut Command::new(compiled("threads", &C, true)));
    assert_eq!(lines, ["same bits on 4 threads"]);
}

#[test]
fn mistakes_have_a_status() {
    let file = folder().join("tests/mistakes.c");
    let lines = lines_of(&mut Command::new(compiled_from(&file, "mistakes", &C, false)));
    let expected = [
        "width 0: 0 bytes",
        "width 0: 7",
        "12 pixels: 0",
        "13 pixels: 8",
        "no points: 0 bytes",
        "1 value: 0",
        "2 values: 8",
        "0 degrees: 0",
        "178 degrees: 0",
        "179 degrees: 8",
        "400 degrees: 8",
        "-40 degrees: 8",
    ];
    assert_eq!(lines, expected);
}

#[test]
fn no_program_touches_memory_that_is_not_its_own() {
    for name in EXAMPLES {
        let sanitized =
            [&C[..], &["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]].concat();
        lines_of(&mut Command::new(compiled(name, &sanitized, false)));
    }
    if !is_installed("valgrind") {
        println!("skipped: valgrind is not installed");
        return;
    }
    for name in ["rays", "nearest", "irradiance"] {
        let mut command = Command::new("valgrind");
        command.args(["-q", "--error-exitcode=9", "--leak-check=full"]).arg(compiled(name, &C, false));
        lines_of(&mut command);
    }
}

#[test]
fn the_header_is_that_of_the_source() {
    let config = cbindgen::Config::from_file(folder().join("cbindgen.toml")).unwrap();
    let mut header = Vec::new();
    cbindgen::Builder::new().with_crate(folder()).with_config(config).generate().unwrap().write(&mut header);
    let header = String::from_utf8(header).unwrap().replace("// # Safety\n", "// Requires:\n");
    assert_file("include/halflight.h", &header);
}

/// Asserts that a file has this text, or writes it.
fn assert_file(name: &str, text: &str) {
    let path = folder().join(name);
    if std::env::var("SNAPSHOT").is_ok_and(|write| write == "write") {
        std::fs::write(&path, text).unwrap();
    }
    assert!(text == read(&path), "{name} is out of date: SNAPSHOT=write cargo test writes it anew");
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}

#[test]
fn the_web_module_has_the_same_bits() {
    let module = folder().join("../wasm/halflight.wasm");
    if !module.exists() {
        println!("skipped: {} is not built; `cargo verify web` does", module.display());
        return;
    }
    let script = folder().join("../wasm/test/module.mjs");
    let program = compiled_from(&folder().join("tests/bits.c"), "bits", &C, false);
    let native = lines_of(&mut Command::new(program));
    let web = lines_of(Command::new("node").arg(script).arg(module));
    assert_eq!(native.len(), 12);
    assert_eq!(native, web);
}
