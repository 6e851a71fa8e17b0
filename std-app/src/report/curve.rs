//! `curve.csv`: error against rendering time, one line per round.

use crate::render::Round;

/// Text of the file. Histories of a race have names; unknown values are empty fields.
pub(super) fn csv(histories: &[(Option<&str>, &[Round])]) -> String {
    let is_named = histories.iter().any(|(name, _)| name.is_some());
    let mut text = String::from(if is_named { "method," } else { "" });
    text += "seconds,spp,rays,relmse,lower,upper,reference_relmse,reference_mse,reference_flip\n";
    for (name, rounds) in histories {
        for round in *rounds {
            let error = round.error.map(|error| [error.relmse, error.lower, error.upper]);
            let reference = round.reference.map(|r| [r.linear.relmse, r.linear.mse, r.flip]);
            let values = [error, reference].into_iter().flat_map(|values| match values {
                Some(values) => values.map(|value| format!("{value:e}")),
                None => [const { String::new() }; 3],
            });
            let counts = [round.seconds.to_string(), round.spp.to_string(), round.rays.to_string()];
            let name = is_named.then(|| quoted(name.unwrap_or_default()));
            text += &name.into_iter().chain(counts).chain(values).collect::<Vec<_>>().join(",");
            text.push('\n');
        }
    }
    text
}

/// CSV field, in quotes if it needs them (RFC 4180).
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::ErrorEstimate;

    #[test]
    fn every_round_is_a_line() {
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
