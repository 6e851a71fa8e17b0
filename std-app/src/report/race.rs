//! Race of several methods on one scene: leaders over time, and efficiencies at the end.

use super::{Provenance, Run};
use crate::render::{ErrorEstimate, Round};
use halflight_core::estimate::NORMAL_95;

/// Finished race.
pub struct Race<'a> {
    /// Methods in the order of the command line.
    pub entries: Vec<RaceEntry<'a>>,
    /// Seconds of rendering of each method.
    pub seconds: f64,
    /// Command, program, machine and date.
    pub provenance: &'a Provenance,
}

/// Method of a race and its picture.
pub struct RaceEntry<'a> {
    /// Method and options as written on the command line.
    pub name: String,
    /// Render of the method.
    pub run: Run<'a>,
}

/// Ratio of two efficiencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// Ratio.
    pub value: f64,
    /// 95 % interval; `None` against a reference.
    pub interval: Option<[f64; 2]>,
}

/// Interval of time with one leader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Rendering seconds of the start.
    pub from: f64,
    /// Rendering seconds of the end.
    pub to: f64,
    /// Index of the method with the smallest error; `None` if intervals overlap.
    pub leader: Option<usize>,
}

/// Logarithm of relMSE after a round, and its standard deviation: 0 against a reference.
#[derive(Clone, Copy)]
struct LogError {
    log: f64,
    deviation: f64,
}

impl Race<'_> {
    /// True if errors are measured against a reference.
    pub fn has_reference(&self) -> bool {
        self.entries.iter().any(|entry| entry.run.settings.reference.is_some())
    }

    /// relMSE of the picture of a method.
    pub fn error(&self, index: usize) -> Option<f64> {
        self.last(index).map(|error| error.log.exp())
    }

    /// 1 / (relMSE · seconds of rendering); `None` if the error is unknown.
    pub fn efficiency(&self, index: usize) -> Option<f64> {
        let run = &self.entries.get(index)?.run;
        Some(1.0 / (self.error(index)? * run.result.seconds.render))
    }

    /// Efficiency of a method over that of the first method.
    pub fn ratio(&self, index: usize) -> Option<Ratio> {
        let value = self.efficiency(index)? / self.efficiency(0)?;
        if index == 0 {
            return Some(Ratio { value: 1.0, interval: None });
        }
        let factor = (NORMAL_95 * self.last(index)?.deviation.hypot(self.last(0)?.deviation)).exp();
        let interval = (!self.has_reference()).then_some([value / factor, value * factor]);
        Some(Ratio { value, interval })
    }

    fn last(&self, index: usize) -> Option<LogError> {
        log_error(self.entries.get(index)?.run.result.history.last()?)
    }

    /// Leaders, from the first picture of any method to the last picture of all.
    pub fn leads(&self) -> Vec<Lead> {
        let curves: Vec<Curve> = self.entries.iter().map(|entry| curve(&entry.run.result.history)).collect();
        leads(&curves)
    }
}

/// Seconds and error of each round.
type Curve = Vec<(f64, LogError)>;

fn curve(history: &[Round]) -> Curve {
    history.iter().filter_map(|round| Some((round.seconds, log_error(round)?))).collect()
}

/// Number of times at which leaders are compared, uniform on a logarithmic axis.
const STEPS: u32 = 200;

fn leads(curves: &[Curve]) -> Vec<Lead> {
    let times = || curves.iter().flatten().map(|(seconds, _)| *seconds);
    let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max));
    if first >= last {
        return Vec::new();
    }
    let time = |step: u32| first * (last / first).powf(f64::from(step) / f64::from(STEPS));
    let mut leads: Vec<Lead> = Vec::new();
    for step in 0..STEPS {
        let (from, to) = (time(step), time(step + 1));
        let leader = leader(curves, (from * to).sqrt());
        match leads.last_mut() {
            Some(lead) if lead.leader == leader => lead.to = to,
            _ => leads.push(Lead { from, to, leader }),
        }
    }
    leads
}

/// Method with the smallest error after `seconds`, of those with a picture by then.
fn leader(curves: &[Curve], seconds: f64) -> Option<usize> {
    let error = |(index, curve): (usize, &Curve)| Some((index, interpolated(curve, seconds)?));
    let mut errors: Vec<(usize, LogError)> = curves.iter().enumerate().filter_map(error).collect();
    errors.sort_by(|a, b| a.1.log.total_cmp(&b.1.log));
    match errors.as_slice() {
        [] => None,
        [(only, _)] => Some(*only),
        [(best, a), (_, b), ..] => {
            let ahead = b.log - a.log;
            (ahead > 0.0 && ahead >= NORMAL_95 * a.deviation.hypot(b.deviation)).then_some(*best)
        }
    }
}

/// Error after `seconds`: linear between rounds on logarithmic axes, constant after the last round.
fn interpolated(curve: &[(f64, LogError)], seconds: f64) -> Option<LogError> {
    let after = curve.partition_point(|(time, _)| *time <= seconds);
    let (start, before) = *curve.get(after.checked_sub(1)?)?;
    let Some(&(end, next)) = curve.get(after) else { return Some(before) };
    let fraction = (seconds / start).ln() / (end / start).ln();
    let mix = |a: f64, b: f64| a + fraction * (b - a);
    Some(LogError { log: mix(before.log, next.log), deviation: mix(before.deviation, next.deviation) })
}

/// Error after a round; `None` if it is unknown or zero.
fn log_error(round: &Round) -> Option<LogError> {
    let error = match (round.reference, round.error) {
        (Some(reference), _) => LogError { log: reference.linear.relmse.ln(), deviation: 0.0 },
        (None, Some(error)) => LogError { log: error.relmse.ln(), deviation: log_deviation(&error) },
        (None, None) => return None,
    };
    (error.log.is_finite() && error.deviation.is_finite()).then_some(error)
}

/// Standard deviation of the logarithm of an error, from its interval.
fn log_deviation(error: &ErrorEstimate) -> f64 {
    if error.lower > 0.0 {
        (error.upper / error.lower).ln() / (2.0 * NORMAL_95)
    } else {
        (error.upper / error.relmse).ln() / NORMAL_95
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounds(error: impl Fn(f64) -> f64, spread: f64) -> Curve {
        let times = (0..10).map(|i| f64::from(1 << i) * 0.1);
        let round = |seconds: f64| {
            let relmse = error(seconds);
            let (lower, upper) = (relmse * (1.0 - spread), relmse * (1.0 + spread));
            let error = Some(ErrorEstimate { relmse, lower, upper });
            Round { seconds, spp: 1, rays: 1, error, reference: None }
        };
        curve(&times.map(round).collect::<Vec<_>>())
    }

    #[test]
    fn lead_changes_where_curves_cross() {
        let (slow, fast) = (rounds(|t| 0.1 * t.powf(-0.5), 0.001), rounds(|t| 0.2 / t, 0.001));
        let leads = leads(&[slow, fast]);
        let leaders: Vec<_> = leads.iter().map(|lead| lead.leader).collect();
        assert_eq!(leaders.first(), Some(&Some(0)));
        assert_eq!(leaders.last(), Some(&Some(1)));
        let change = leads.iter().find(|lead| lead.leader == Some(1)).unwrap().from;
        assert!((change / 4.0 - 1.0).abs() < 0.05, "0.1 t^-1/2 = 0.2 / t at t = 4, not {change}");
        assert!(leads.windows(2).all(|pair| pair[0].to == pair[1].from && pair[0].leader != pair[1].leader));
    }

    #[test]
    fn overlapping_intervals_have_no_leader() {
        let (a, b) = (rounds(|t| 1.0 / t, 0.2), rounds(|t| 1.1 / t, 0.2));
        assert!(leads(&[a.clone(), b]).iter().all(|lead| lead.leader.is_none()));
        assert!(leads(&[a.clone(), rounds(|t| 9.0 / t, 0.2)]).iter().all(|lead| lead.leader == Some(0)));
        assert!(
            leads(core::slice::from_ref(&a)).iter().all(|lead| lead.leader == Some(0)),
            "a single method leads"
        );
        assert!(leads(&[a[..1].into()]).is_empty() && leads(&[]).is_empty());
    }
}
