//! Several methods on one scene for the same time: who is ahead when, and by how much in the end.

use super::{Maker, Run};
use crate::drive::{ErrorEstimate, Round};

/// A race that is over.
pub struct Race<'a> {
    /// The methods in the order in which they were named.
    pub racers: Vec<Racer<'a>>,
    /// Seconds of rendering that each was given.
    pub seconds: f64,
    /// Who held it.
    pub maker: &'a Maker,
}

/// A method and its picture.
pub struct Racer<'a> {
    /// The method and its options, as they were asked for.
    pub name: String,
    /// What came out.
    pub run: Run<'a>,
}

/// How many times the efficiency of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// The ratio.
    pub value: f64,
    /// Where it lies with 95 % confidence; unknown against a reference.
    pub interval: Option<[f64; 2]>,
}

/// A stretch of time with one method in the lead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Seconds of rendering where it begins.
    pub from: f64,
    /// Seconds where it ends.
    pub to: f64,
    /// Index of the method with the smallest error; `None` where the intervals do not tell.
    pub who: Option<usize>,
}

/// What is known of the error after a round: ln relMSE, and its standard deviation, 0 against a reference.
#[derive(Clone, Copy)]
struct Known {
    log: f64,
    deviation: f64,
}

impl Race<'_> {
    /// Whether errors are measured against a reference, not estimated.
    pub fn has_reference(&self) -> bool {
        self.racers.iter().any(|racer| racer.run.settings.reference.is_some())
    }

    /// The relMSE of the picture of a method.
    pub fn error(&self, index: usize) -> Option<f64> {
        self.last(index).map(|known| known.log.exp())
    }

    /// 1 / (relMSE · seconds of rendering); `None` where the error is not known.
    pub fn efficiency(&self, index: usize) -> Option<f64> {
        let run = &self.racers.get(index)?.run;
        Some(1.0 / (self.error(index)? * run.result.seconds.render))
    }

    /// The efficiency of a method over that of the first.
    pub fn ratio(&self, index: usize) -> Option<Ratio> {
        let value = self.efficiency(index)? / self.efficiency(0)?;
        if index == 0 {
            return Some(Ratio { value: 1.0, interval: None });
        }
        let reach = (NORMAL_95 * self.last(index)?.deviation.hypot(self.last(0)?.deviation)).exp();
        let interval = (!self.has_reference()).then_some([value / reach, value * reach]);
        Some(Ratio { value, interval })
    }

    fn last(&self, index: usize) -> Option<Known> {
        known(self.racers.get(index)?.run.result.history.last()?)
    }

    /// Who is ahead, from the first picture of any to the last of all.
    pub fn leads(&self) -> Vec<Lead> {
        let curves: Vec<Curve> = self.racers.iter().map(|racer| curve(&racer.run.result.history)).collect();
        leads(&curves)
    }
}

/// Seconds, and what is known then.
type Curve = Vec<(f64, Known)>;

fn curve(history: &[Round]) -> Curve {
    history.iter().filter_map(|round| Some((round.seconds, known(round)?))).collect()
}

/// Times at which the leader is asked for, evenly on a logarithmic axis.
const MOMENTS: u32 = 200;

fn leads(curves: &[Curve]) -> Vec<Lead> {
    let first =
        curves.iter().filter_map(|curve| curve.first()).map(|(at, _)| *at).fold(f64::INFINITY, f64::min);
    let last = curves.iter().filter_map(|curve| curve.last()).map(|(at, _)| *at).fold(0.0, f64::max);
    if first >= last {
        return Vec::new();
    }
    let moment = |i: u32| first * (last / first).powf(f64::from(i) / f64::from(MOMENTS));
    let mut leads: Vec<Lead> = Vec::new();
    for i in 0..MOMENTS {
        let (from, to) = (moment(i), moment(i + 1));
        let who = leader(curves, (from * to).sqrt());
        match leads.last_mut() {
            Some(lead) if lead.who == who => lead.to = to,
            _ => leads.push(Lead { from, to, who }),
        }
    }
    leads
}

/// Who has the smallest error after `seconds`, among those who have a picture by then.
fn leader(curves: &[Curve], seconds: f64) -> Option<usize> {
    let mut standing: Vec<(usize, Known)> =
        curves.iter().enumerate().filter_map(|(index, curve)| Some((index, at(curve, seconds)?))).collect();
    standing.sort_by(|a, b| a.1.log.total_cmp(&b.1.log));
    match standing.as_slice() {
        [] => None,
        [(only, _)] => Some(*only),
        [(best, a), (_, b), ..] => {
            let ahead = b.log - a.log;
            (ahead > 0.0 && ahead >= NORMAL_95 * a.deviation.hypot(b.deviation)).then_some(*best)
        }
    }
}

/// What is known after `seconds`: a straight line between rounds, on logarithmic axes; after the last round,
/// that.
fn at(curve: &[(f64, Known)], seconds: f64) -> Option<Known> {
    let after = curve.partition_point(|(at, _)| *at <= seconds);
    let (start, before) = *curve.get(after.checked_sub(1)?)?;
    let Some(&(end, next)) = curve.get(after) else { return Some(before) };
    let share = (seconds / start).ln() / (end / start).ln();
    let mix = |a: f64, b: f64| a + share * (b - a);
    Some(Known { log: mix(before.log, next.log), deviation: mix(before.deviation, next.deviation) })
}

/// `None` where there is no error to take the logarithm of.
fn known(round: &Round) -> Option<Known> {
    let known = match (round.reference, round.error) {
        (Some(reference), _) => Known { log: reference.linear.relmse.ln(), deviation: 0.0 },
        (None, Some(error)) => Known { log: error.relmse.ln(), deviation: log_deviation(&error) },
        (None, None) => return None,
    };
    (known.log.is_finite() && known.deviation.is_finite()).then_some(known)
}

/// Standard deviation of the logarithm of an error, from its interval.
fn log_deviation(error: &ErrorEstimate) -> f64 {
    if error.lower > 0.0 {
        (error.upper / error.lower).ln() / (2.0 * NORMAL_95)
    } else {
        (error.upper / error.relmse).ln() / NORMAL_95
    }
}

/// Standard deviations on both sides of a normal mean that hold 95 %.
const NORMAL_95: f64 = 1.96;

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
    fn the_lead_changes_where_the_curves_cross() {
        let (slow, fast) = (rounds(|t| 0.1 * t.powf(-0.5), 0.001), rounds(|t| 0.2 / t, 0.001));
        let leads = leads(&[slow, fast]);
        let who: Vec<_> = leads.iter().map(|lead| lead.who).collect();
        assert_eq!(who.first(), Some(&Some(0)));
        assert_eq!(who.last(), Some(&Some(1)));
        let change = leads.iter().find(|lead| lead.who == Some(1)).unwrap().from;
        assert!((change / 4.0 - 1.0).abs() < 0.05, "0.1 t^-1/2 = 0.2 / t at t = 4, not {change}");
        assert!(leads.windows(2).all(|pair| pair[0].to == pair[1].from && pair[0].who != pair[1].who));
    }

    #[test]
    fn intervals_that_overlap_leave_it_open() {
        let (a, b) = (rounds(|t| 1.0 / t, 0.2), rounds(|t| 1.1 / t, 0.2));
        assert!(leads(&[a.clone(), b]).iter().all(|lead| lead.who.is_none()));
        assert!(leads(&[a.clone(), rounds(|t| 9.0 / t, 0.2)]).iter().all(|lead| lead.who == Some(0)));
        assert!(leads(core::slice::from_ref(&a)).iter().all(|lead| lead.who == Some(0)), "nobody else");
        assert!(leads(&[a[..1].into()]).is_empty() && leads(&[]).is_empty());
    }
}
