//! The table of stiff and extreme cases: what a picture or a kernel must give by theory, and what it gives.
//!
//! Every expectation is a known answer (a furnace, a formula, an invariance, an f64 reference), none a recorded result. A
//! random picture may be off by [`SIGMAS`] of its standard errors; what has no noise by rounding alone.

mod derivatives;
mod geometry;
mod kernels;
mod light;
mod searches;
mod surfaces;
mod view;
mod world;

use world::{Measured, World};

/// Standard errors that a picture may be off by. Estimated from some hundred pixels; chance alone breaks one case of a
/// hundred thousand.
const SIGMAS: f64 = 4.5;

/// What rounding in f32 may do to the mean of a picture without noise: paths of a few dozen products.
const ROUNDING: f64 = 2e-5;

/// A case and how it went.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What kind of case it is.
    pub group: &'static str,
    /// What is stiff about it.
    pub case: String,
    /// What it must give.
    pub expected: String,
    /// What it gives.
    pub measured: String,
    /// Whether both agree.
    pub passed: bool,
}

/// Runs the cases whose kind or name is `wanted`; `tell` sees each as it ends.
pub fn run(wanted: &dyn Fn(&str) -> bool, tell: &mut dyn FnMut(&Outcome)) -> Vec<Outcome> {
    let mut table = Table { wanted, tell, outcomes: Vec::new() };
    geometry::cases(&mut table);
    light::cases(&mut table);
    surfaces::cases(&mut table);
    view::cases(&mut table);
    kernels::cases(&mut table);
    derivatives::cases(&mut table);
    searches::cases(&mut table);
    table.outcomes
}

/// What cases write to.
struct Table<'a> {
    wanted: &'a dyn Fn(&str) -> bool,
    tell: &'a mut dyn FnMut(&Outcome),
    outcomes: Vec<Outcome>,
}

impl Table<'_> {
    fn wants(&self, group: &str, case: &str) -> bool {
        (self.wanted)(group) || (self.wanted)(case)
    }

    fn add(&mut self, outcome: Outcome) {
        (self.tell)(&outcome);
        self.outcomes.push(outcome);
    }

    /// The mean radiance of the picture of `world` is `expected`, and each of its pixels is a number.
    fn radiance(&mut self, group: &'static str, case: impl Into<String>, world: &World, expected: f64) {
        self.radiance_within(group, case, world, expected, ROUNDING);
    }

    /// The same with another relative `tolerance` beside the noise, for a reason that the caller knows.
    fn radiance_within(
        &mut self,
        group: &'static str,
        case: impl Into<String>,
        world: &World,
        expected: f64,
        tolerance: f64,
    ) {
        let case = case.into();
        if !self.wants(group, &case) {
            return;
        }
        let (measured, passed) = match world.measure() {
            Err(error) => (error, false),
            Ok(Measured { mean, error, lost }) => {
                let reach = SIGMAS * error + tolerance * expected.abs();
                let passed = (mean - expected).abs() <= reach && lost == 0;
                let lost = if lost > 0 { format!(", {lost} samples lost") } else { String::new() };
                (format!("{} ± {}{lost}", short(mean), short(error)), passed)
            }
        };
        self.add(Outcome { group, case, expected: short(expected), measured, passed });
    }

    /// A kernel is off by `most` units at most; `measured` is the worst that was found.
    fn units(&mut self, case: impl Into<String>, most: f64, measured: f64) {
        let case = case.into();
        if !self.wants("kernels", &case) {
            return;
        }
        self.add(Outcome {
            group: "kernels",
            case,
            expected: format!("at most {most} ulp"),
            measured: format!("{measured:.2} ulp"),
            passed: measured <= most,
        });
    }

    /// A kernel whose answers are right or wrong: `wrong` of `all` are. Less than a thousand would say nothing.
    fn exact(&mut self, case: impl Into<String>, wrong: u32, all: u32) {
        let case = case.into();
        if !self.wants("kernels", &case) {
            return;
        }
        let (expected, measured) = ("none wrong".into(), format!("{wrong} of {all} wrong"));
        self.add(Outcome { group: "kernels", case, expected, measured, passed: wrong == 0 && all > 1000 });
    }
}

/// A number in five digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        let digits = 4 - value.abs().max(1e-3).log10().floor() as i32;
        return format!("{value:.*}", digits.clamp(0, 7) as usize);
    }
    format!("{value:.4e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_holds() {
        let outcomes = run(&|_| true, &mut |_| {});
        let failed: Vec<_> = outcomes.iter().filter(|outcome| !outcome.passed).collect();
        assert!(failed.is_empty(), "{failed:#?}");
        assert!(outcomes.len() > 80, "{}", outcomes.len());
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.0, 1.0, 123.456789, 0.0123].map(short), ["0.0000000", "1.0000", "123.46", "0.012300"]);
        assert_eq!(short(1e20), "1.0000e20");
    }
}
