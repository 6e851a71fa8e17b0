//! Driver without nightly: `mutate TARGET [--seconds N] [--runs N] [--seed N]` runs a target over its corpus,
//! then over seeded mutations of it until either limit. Without coverage feedback it finds less than
//! libFuzzer. The input that failed stays in `fuzz/artifacts/TARGET/`.
#![forbid(unsafe_code)]

use halflight_fuzz::{TARGETS, Target};
use halflight_test_support::Random;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{env, fs, panic};

/// Longest input, bytes.
const MAX_LENGTH: usize = 4096;

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let number = |name: &str, otherwise: u64| {
        let position = arguments.iter().position(|argument| argument == name);
        let value = position.and_then(|at| arguments.get(at + 1));
        value.and_then(|value| value.parse().ok()).unwrap_or(otherwise)
    };
    let name = arguments.first().map_or("", |name| name);
    let Some(Target { name, run }) = TARGETS.iter().find(|target| target.name == name) else {
        let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("mutate TARGET [--seconds N] [--runs N] [--seed N]; targets: {}", names.join(", "));
        return ExitCode::from(2);
    };
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let corpus = files(&home.join("corpus").join(name));
    let mut random = Random(number("--seed", 1).max(1));
    let end = Instant::now() + Duration::from_secs(number("--seconds", 20));
    // A negative number means no limit.
    let most_runs = number("--runs", u64::MAX);

    let mut runs = 0u64;
    let mut inputs = corpus.iter().cloned();
    while runs < corpus.len() as u64 || runs < most_runs && Instant::now() < end {
        let input = inputs.next().unwrap_or_else(|| mutated(&corpus, &mut random));
        if panic::catch_unwind(|| run(&input)).is_err() {
            let folder = home.join("artifacts").join(name);
            let path = folder.join(format!("crash-run-{runs}"));
            let saved = fs::create_dir_all(&folder).and_then(|()| fs::write(&path, &input));
            eprintln!("{name}: run {runs} failed; input {} {saved:?}", path.display());
            return ExitCode::FAILURE;
        }
        runs += 1;
    }
    println!("{name}: {runs} runs, {} of them the corpus", corpus.len());
    ExitCode::SUCCESS
}

/// An input of the corpus with bytes changed, removed, doubled or replaced by a part of another input.
fn mutated(corpus: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let pick = |random: &mut Random| corpus.get(random.below(corpus.len())).cloned().unwrap_or_default();
    let mut input = pick(random);
    for _ in 0..1 + random.below(8) {
        let at = random.below(input.len() + 1);
        let end = (at + 1 + random.below(16)).min(input.len()).max(at);
        match random.below(5) {
            0 if at < input.len() => input[at] ^= 1 << random.below(8),
            1 if at < input.len() => input[at] = random.bits() as u8,
            2 => drop(input.drain(at..end)),
            3 => drop(input.splice(at..at, input[at..end].to_vec())),
            _ => {
                let other = pick(random);
                let from = random.below(other.len() + 1);
                let to = (from + random.below(64)).min(other.len());
                input.splice(at..end, other[from..to].iter().copied());
                input.extend((0..random.below(32)).map(|_| random.bits() as u8));
            }
        }
    }
    input.truncate(MAX_LENGTH);
    input
}

fn files(folder: &Path) -> Vec<Vec<u8>> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths.iter().filter_map(|path| fs::read(path).ok()).collect()
}
