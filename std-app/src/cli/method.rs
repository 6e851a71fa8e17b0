//! The values of `--method`: those of the library, and `auto`.

use clap::ValueEnum;
use clap::builder::PossibleValue;
use halflight::drive::Method;
use halflight::load::RenderSettings;

/// A method, or `None`, what fits the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice(pub(super) Option<Method>);

const CHOICES: [Choice; 1 + Method::ALL.len()] = {
    let mut choices = [Choice(None); 1 + Method::ALL.len()];
    let mut i = 0;
    while i < Method::ALL.len() {
        choices[i + 1] = Choice(Some(Method::ALL[i]));
        i += 1;
    }
    choices
};

impl Choice {
    const fn name(self) -> &'static str {
        match self.0 {
            None => "auto",
            Some(method) => method.name(),
        }
    }
}

impl ValueEnum for Choice {
    fn value_variants<'a>() -> &'a [Self] {
        &CHOICES
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let about = self.0.map_or("path, or sppm if caustics are nearly all of the light", Method::about);
        Some(PossibleValue::new(self.name()).help(about))
    }
}

/// What a scene file asks for.
pub(super) fn of_file(settings: &RenderSettings) -> Option<Method> {
    Choice::from_str(settings.method.as_deref()?, true).ok()?.0
}

/// The names as a person lists them.
pub(super) fn names() -> String {
    CHOICES.map(Choice::name).join(", ")
}
