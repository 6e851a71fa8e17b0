//! Findings: decisions and numbers of a method, in one form for every report.
//!
//! A method pushes one [`Finding`] for each of its parts. JSON, report page and summary print the list
//! without knowing the method.

/// Largest number of values of a finding.
const MAX_VALUES: usize = 12;

/// Largest number of findings of a list.
const MAX_FINDINGS: usize = 12;

/// Use of a part of a method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decision {
    /// Used in full.
    #[default]
    Used,
    /// Used with fewer records or photons than wanted.
    Limited,
    /// Not used.
    LeftOut,
}

impl Decision {
    /// Name in reports: `used`, `limited` or `left out`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Limited => "limited",
            Self::LeftOut => "left out",
        }
    }
}

/// Value of a finding, with its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Number of things.
    Count(u64),
    /// Wall-clock time in seconds.
    Seconds(f64),
    /// Fraction of a whole, mostly in [0, 1]; reports print percent.
    Fraction(f64),
    /// Number without a unit.
    Number(f64),
    /// Name of a choice.
    Name(&'static str),
    /// Predicted picture of a candidate.
    Prediction {
        /// relMSE; infinite where it is no choice.
        error: f64,
        /// Rays of a sample of a pixel.
        work: f64,
        /// Origin of the prediction, or the reason for none.
        reason: &'static str,
    },
}

/// Decision on one part of a method, with its reason and numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Finding {
    /// Part of the method in snake case, as `caustic_photons`; a JSON key, unique in a list.
    pub topic: &'static str,
    /// Use of the part.
    pub decision: Decision,
    /// Reason of the decision: a phrase without a full stop, or empty.
    pub reason: &'static str,
    /// Phase of the executor whose time is that of the part.
    pub phase: Option<&'static str>,
    values: [Option<(&'static str, Value)>; MAX_VALUES],
}

impl Finding {
    /// Finding without values.
    pub const fn new(topic: &'static str, decision: Decision, reason: &'static str) -> Self {
        Self { topic, decision, reason, phase: None, values: [None; MAX_VALUES] }
    }

    /// This finding with one more value; `name` in snake case. A thirteenth value is ignored.
    pub fn with(mut self, name: &'static str, value: Value) -> Self {
        if let Some(free) = self.values.iter_mut().find(|slot| slot.is_none()) {
            *free = Some((name, value));
        }
        self
    }

    /// [`Self::with`] if there is a value.
    pub fn with_some(self, name: &'static str, value: Option<Value>) -> Self {
        match value {
            Some(value) => self.with(name, value),
            None => self,
        }
    }

    /// [`Self::with`] for a count above zero.
    pub fn with_count(self, name: &'static str, count: u64) -> Self {
        self.with_some(name, (count > 0).then_some(Value::Count(count)))
    }

    /// This finding of a part whose work is the executor's `phase`.
    pub const fn timed(self, phase: &'static str) -> Self {
        Self { phase: Some(phase), ..self }
    }

    /// Number of the value `name`; `None` without such a value or if it is a name.
    pub fn number(&self, name: &str) -> Option<f64> {
        match self.values().find(|(other, _)| *other == name)?.1 {
            Value::Count(count) => Some(count as f64),
            Value::Seconds(value) | Value::Fraction(value) | Value::Number(value) => Some(value),
            Value::Prediction { error, .. } => error.is_finite().then_some(error),
            Value::Name(_) => None,
        }
    }

    /// Names and values in order.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, Value)> {
        self.values.iter().flatten().copied()
    }
}

/// List of at most twelve findings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Findings([Option<Finding>; MAX_FINDINGS]);

impl Findings {
    /// Appends a finding. A thirteenth finding is ignored.
    pub fn push(&mut self, finding: Finding) {
        if let Some(free) = self.0.iter_mut().find(|slot| slot.is_none()) {
            *free = Some(finding);
        }
    }

    /// Finding on a part of the method.
    pub fn get(&self, topic: &str) -> Option<&Finding> {
        self.iter().find(|finding| finding.topic == topic)
    }

    /// These findings and others.
    pub fn and<I: IntoIterator<Item = Finding>>(mut self, others: I) -> Self {
        self.extend(others);
        self
    }

    /// Findings in order.
    pub fn iter(&self) -> impl Iterator<Item = &Finding> {
        self.0.iter().flatten()
    }
}

impl From<Finding> for Findings {
    fn from(finding: Finding) -> Self {
        let mut findings = Self::default();
        findings.push(finding);
        findings
    }
}

impl Extend<Finding> for Findings {
    fn extend<I: IntoIterator<Item = Finding>>(&mut self, findings: I) {
        findings.into_iter().for_each(|finding| self.push(finding));
    }
}

impl IntoIterator for Findings {
    type Item = Finding;
    type IntoIter = core::iter::Flatten<core::array::IntoIter<Option<Finding>, MAX_FINDINGS>>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn lists_keep_order_and_ignore_entries_beyond_capacity() {
        let mut finding = Finding::new("path_reuse", Decision::Used, "");
        for count in 1..20 {
            finding = finding.with_count("pixels", count);
        }
        let values: Vec<_> = finding.with_count("none", 0).values().collect();
        let expected: Vec<_> = (1..=MAX_VALUES as u64).map(|count| ("pixels", Value::Count(count))).collect();
        assert_eq!(values, expected);

        let topics = ["a", "b", "c", "d", "e", "f", "g", "h", "i"];
        let mut list = Findings::default();
        list.extend(topics.map(|topic| Finding::new(topic, Decision::LeftOut, "")));
        assert!(list.iter().map(|finding| finding.topic).eq(topics.into_iter().take(MAX_FINDINGS)));
    }

    #[test]
    fn values_are_found_by_topic_and_name() {
        let finding = Finding::new("photon_maps", Decision::Used, "").timed("photons");
        let mut list = Findings::default();
        list.push(finding.with_count("maps", 6).with("kernel", Value::Name("cone")));
        let found = list.get("photon_maps").unwrap();
        assert_eq!(
            (found.phase, found.number("maps"), found.number("kernel")),
            (Some("photons"), Some(6.0), None)
        );
        assert!(list.get("caustic_photons").is_none() && found.number("seconds").is_none());
    }
}
