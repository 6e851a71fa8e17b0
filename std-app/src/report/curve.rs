//! `curve.csv`: the error against run time, a line for each round.

use crate::drive::Round;
use core::fmt::Write;

/// The histories of one render without a name, or of several with the names of their methods. What is not known
/// is an empty field.
pub(super) fn csv(histories: &[(Option<&str>, &[Round])]) -> String {
    let named = histories.iter().any(|(name, _)| name.is_some());
    let mut text = String::from(if named { "method," } else { "" });
    text += "seconds,spp,rays,relmse,lower,upper,reference_relmse,reference_mse,reference_flip\n";
    for (name, rounds) in histories {
        for round in *rounds {
            if named {
                text += &field(name.unwrap_or_default());
                text.push(',');
            }
            let error = round.error.map(|error| [error.relmse, error.lower, error.upper]);
            let against = round.reference.map(|r| (r.linear.relmse, r.linear.mse, r.flip));
            // Writing to a string does not fail.
            let _ = write!(text, "{},{},{}", round.seconds, round.spp, round.rays);
            for value in (0..3).map(|i| error.map(|error| error[i])).chain([
                against.map(|(relmse, _, _)| relmse),
                against.map(|(_, mse, _)| mse),
                against.map(|(_, _, flip)| flip),
            ]) {
                text.push(',');
                let _ = value.map_or(Ok(()), |value| write!(text, "{value:e}"));
            }
            text.push('\n');
        }
    }
    text
}

/// Quoted where it must be (RFC 4180).
fn field(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::ErrorEstimate;

    #[test]
    fn a_line_for_each_round() {
        let round = Round { seconds: 0.5, spp: 1, rays: 10, error: None, reference: None };
        let error = ErrorEstimate { relmse: 0.25, lower: 0.125, upper: 0.5 };
        let rounds = [round, Round { seconds: 1.5, spp: 2, error: Some(error), ..round }];
        let text = csv(&[(None, &rounds)]);
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, ["0.5,1,10,,,,,,", "1.5,2,10,2.5e-1,1.25e-1,5e-1,,,"]);
        let named = csv(&[(Some("a,b"), &rounds[..1])]);
        assert!(named.ends_with("\n\"a,b\",0.5,1,10,,,,,,\n"), "{named}");
    }
}
