//! Texture statements: `[-option values]... file name with blanks`. Options may follow the name too, and
//! names may resemble options or contain ` #`; the existing file decides among the readings.

use super::error::TextPlace;
use super::files::{Found, Lookup};
use super::name::{Name, unquoted, without_comments};
use super::notes::Notes;
use super::text::{self, is_blank, trimmed, word_starts};
use halflight_core::scene::Wrap;
use std::path::{Path, PathBuf};

/// A texture statement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// All that follows the keyword.
    pub operand: Name,
    /// Line of the statement; 0: none.
    pub line: u32,
    /// The located file, if it exists.
    pub found: Option<PathBuf>,
    /// Options of the reading that names the file.
    pub options: MapOptions,
    /// The place in a scene file that names it.
    pub named: Option<TextPlace>,
}

/// The number that a map takes from a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channel {
    /// 0 red, 1 green, 2 blue, 3 matte, which is alpha.
    Component(u8),
    /// Luminance.
    Luminance,
}

/// The options of a texture statement.
#[derive(Clone, Debug, PartialEq)]
pub struct MapOptions {
    /// `-s u v`.
    pub scale: [f64; 2],
    /// `-o u v`.
    pub offset: [f64; 2],
    /// `-clamp on`, or the sampler of glTF.
    pub wrap: Wrap,
    /// `-bm`.
    pub bump_multiplier: Option<f64>,
    /// `-imfchan r|g|b|m|l`: the channel of a scalar map or of heights.
    pub channel: Option<Channel>,
    /// Not in MTL: opacity is 1 from this alpha on, and 0 below.
    pub threshold: Option<f64>,
    /// Not in MTL: the second set of texture coordinates is meant.
    pub second_set: bool,
    /// Options without effect.
    pub unsupported: Vec<Name>,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self {
            scale: [1.0; 2],
            offset: [0.0; 2],
            wrap: Wrap::REPEAT,
            bump_multiplier: None,
            channel: None,
            threshold: None,
            second_set: false,
            unsupported: Vec::new(),
        }
    }
}

impl Map {
    /// A map of a located file.
    pub(super) fn of_file(name: &str, found: PathBuf) -> Self {
        Self { operand: name.into(), found: Some(found), ..Self::default() }
    }

    /// The located file, and the place in a scene file that names it.
    pub(super) fn required(&self) -> Option<(PathBuf, TextPlace)> {
        self.found.clone().zip(self.named.clone())
    }

    /// The statement with this operand; `None` if it names no file.
    pub(super) fn of_statement(operand: &[u8], line: u32) -> Option<Self> {
        (!plain_name(operand).is_empty()).then(|| Self { operand: operand.into(), line, ..Self::default() })
    }

    /// Locates the file in one of `directories`, the likeliest first, and sets the options.
    pub(super) fn locate(&mut self, lookup: &mut Lookup, directories: &[&Path], notes: &mut Notes) {
        let mut readings = readings(self.operand.bytes());
        let names: Vec<&[u8]> = readings.iter().map(|reading| reading.name).collect();
        let found = lookup.locate(&names, directories);
        let name = match found {
            Found::Exact(_, number) | Found::Instead(_, number) => readings[number].name,
            _ => plain_name(self.operand.bytes()),
        };
        if let Some(note) = found.note("texture", name) {
            notes.at(self.line, if found.file().is_none() { note + ": constant value" } else { note });
        }
        if let Found::Exact(file, number) | Found::Instead(file, number) = found {
            self.options = readings.swap_remove(number).options;
            self.found = Some(file);
            for option in &self.options.unsupported {
                notes.at(self.line, format!("map option `{option}` is not supported: left out"));
            }
        }
    }
}

/// Readings of a statement that are tried.
const MOST_READINGS: usize = 64;
/// Possible starts and ends of a name that are tried.
const MOST_STARTS: usize = 8;
/// A longer operand, in words, is a name without options.
const MOST_WORDS: usize = 128;
/// Values of an unknown option.
const MOST_VALUES: usize = 3;

/// A possible meaning of a texture statement.
#[derive(Clone, Debug, PartialEq)]
struct Reading<'a> {
    name: &'a [u8],
    options: MapOptions,
}

/// Start of a word, and the word.
type Token<'a> = (usize, &'a [u8]);

/// Words of an operand, in which `#` begins no comment.
fn tokens(operand: &[u8]) -> Vec<Token<'_>> {
    let end =
        |i: usize| operand[i..].iter().position(|&byte| is_blank(byte)).map_or(operand.len(), |n| i + n);
    let tokens: Vec<Token> =
        word_starts(operand).map(|i| (i, &operand[i..end(i)])).take(MOST_WORDS + 1).collect();
    if tokens.len() > MOST_WORDS { vec![(0, operand)] } else { tokens }
}

/// Readings of an operand, the likeliest first: all leading options, then fewer; of the rest the whole, then
/// without options after the name, then without comments; unknown options last.
fn readings(operand: &[u8]) -> Vec<Reading<'_>> {
    let tokens = tokens(operand);
    let mut starts = leading(&tokens);
    starts.reverse();
    starts.truncate(MOST_STARTS);
    let known = starts.len();
    starts.extend(beyond_unknown(&tokens, starts.first()));
    let mut readings: Vec<Reading> = Vec::new();
    for (number, (at, options)) in starts.iter().enumerate() {
        let Some(&(begin, _)) = tokens.get(*at) else { continue };
        let text = if *at == 0 { operand } else { &operand[begin..] };
        for head in [text].into_iter().chain(without_comments(text)) {
            add(&mut readings, head, options);
            add_with_trailing_options(&mut readings, head, options, number < known);
        }
    }
    readings.truncate(MOST_READINGS);
    readings
}

fn add<'a>(readings: &mut Vec<Reading<'a>>, name: &'a [u8], options: &MapOptions) {
    for name in [name, trimmed(name), unquoted(trimmed(name))] {
        if !trimmed(name).is_empty() && readings.iter().all(|known| known.name != name) {
            readings.push(Reading { name, options: options.clone() });
        }
    }
}

/// Possible starts of the name after known options only: number of words, and the options.
fn leading(tokens: &[Token]) -> Vec<(usize, MapOptions)> {
    let mut starts = vec![(0, MapOptions::default())];
    while let Some((at, options)) = starts.last() {
        let mut options = options.clone();
        let Some(next) = option(tokens, *at, &mut options) else { break };
        starts.push((next, options));
    }
    starts
}

/// Possible starts of the name after an unknown option and its values.
fn beyond_unknown(tokens: &[Token], start: Option<&(usize, MapOptions)>) -> Vec<(usize, MapOptions)> {
    let Some((at, options)) = start else { return Vec::new() };
    let Some((_, word @ [b'-', _, ..])) = tokens.get(*at) else { return Vec::new() };
    let skip = |values: usize| {
        let mut options = options.clone();
        options.unsupported.push((*word).into());
        (known_options(tokens, at + 1 + values, &mut options), options)
    };
    (0..=MOST_VALUES).map(skip).collect()
}

/// Adds the readings of `head` with options after the name, the longest name first; then, if `allow_unknown`,
/// those with unknown options.
fn add_with_trailing_options<'a>(
    readings: &mut Vec<Reading<'a>>,
    head: &'a [u8],
    options: &MapOptions,
    allow_unknown: bool,
) {
    let tokens = tokens(head);
    let mut later = Vec::new();
    let starts = (1..tokens.len()).rev().filter(|&at| tokens[at].1.starts_with(b"-"));
    for start in starts.take(MOST_STARTS) {
        let mut options = options.clone();
        let mut next = start;
        let mut known = true;
        while next < tokens.len() {
            next = option(&tokens, next, &mut options).unwrap_or_else(|| {
                known = false;
                if tokens[next].1.starts_with(b"-") {
                    options.unsupported.push(tokens[next].1.into());
                }
                next + 1
            });
        }
        let name = trimmed(&head[..tokens[start].0]);
        if known {
            add(readings, name, &options);
        } else if allow_unknown {
            later.push((name, options));
        }
    }
    later.into_iter().for_each(|(name, options)| add(readings, name, &options));
}

/// The name for messages if no file exists: the operand without leading and trailing options.
fn plain_name(operand: &[u8]) -> &[u8] {
    let tokens = tokens(operand);
    let first = known_options(&tokens, 0, &mut MapOptions::default());
    let Some(&(begin, _)) = tokens.get(first) else { return &[] };
    let all_options = |at: &usize| known_options(&tokens, *at, &mut MapOptions::default()) == tokens.len();
    let end = (first + 1..tokens.len()).find(all_options).map_or(operand.len(), |at| tokens[at].0);
    unquoted(trimmed(&operand[begin..end]))
}

/// Reads known options from word `at` on. Returns the number of the word after them.
fn known_options(tokens: &[Token], mut at: usize, options: &mut MapOptions) -> usize {
    while let Some(next) = option(tokens, at, options) {
        at = next;
    }
    at
}

/// Reads the option at word `at`. Returns the number of the word after it; `None` if it is no known option.
fn option(tokens: &[Token], at: usize, options: &mut MapOptions) -> Option<usize> {
    let (_, word) = tokens.get(at)?;
    let name = word.strip_prefix(b"-")?.to_ascii_lowercase();
    let value = tokens.get(at + 1).map_or(&b""[..], |(_, word)| word);
    let numbers = |most: usize| -> Vec<f64> {
        tokens[at + 1..].iter().take(most).map_while(|(_, word)| text::number(word)).collect()
    };
    let switch = usize::from(value.eq_ignore_ascii_case(b"on") || value.eq_ignore_ascii_case(b"off"));
    let mut unsupported = || options.unsupported.push((*word).into());
    let values = match &name[..] {
        b"s" | b"o" => {
            let numbers = numbers(3);
            let uv = if name == b"s" { &mut options.scale } else { &mut options.offset };
            uv.iter_mut().zip(&numbers).for_each(|(uv, number)| *uv = *number);
            numbers.len()
        }
        b"bm" => {
            let numbers = numbers(1);
            options.bump_multiplier = numbers.first().copied().or(options.bump_multiplier);
            numbers.len()
        }
        b"clamp" => {
            let is_on = value.eq_ignore_ascii_case(b"on");
            options.wrap = if is_on { Wrap::CLAMP } else { Wrap::REPEAT };
            switch
        }
        b"imfchan" => {
            let letter = value.to_ascii_lowercase();
            match &letter[..] {
                b"r" => options.channel = Some(Channel::Component(0)),
                b"g" => options.channel = Some(Channel::Component(1)),
                b"b" => options.channel = Some(Channel::Component(2)),
                b"m" => options.channel = Some(Channel::Component(3)),
                b"l" => options.channel = Some(Channel::Luminance),
                // Pictures of surfaces have no depth.
                b"z" => options.unsupported.push("-imfchan z".into()),
                _ => {}
            }
            usize::from(matches!(&letter[..], b"r" | b"g" | b"b" | b"m" | b"l" | b"z"))
        }
        b"blendu" | b"blendv" | b"cc" => {
            unsupported();
            switch
        }
        b"type" => {
            unsupported();
            usize::from(!value.is_empty())
        }
        b"t" | b"mm" | b"boost" | b"texres" => {
            unsupported();
            numbers(match name[0] {
                b't' if name.len() == 1 => 3,
                b'm' => 2,
                _ => 1,
            })
            .len()
        }
        _ => return None,
    };
    Some(at + 1 + values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::name::shown;

    fn all(operand: &str) -> Vec<(String, MapOptions)> {
        readings(operand.as_bytes()).into_iter().map(|r| (shown(r.name).into(), r.options)).collect()
    }

    fn options(operand: &str, name: &str) -> MapOptions {
        let all = all(operand);
        let found = all.iter().find(|(known, _)| known == name);
        found.unwrap_or_else(|| panic!("{name} is no reading of {operand}: {all:?}")).1.clone()
    }

    fn names(operand: &str) -> Vec<String> {
        all(operand).into_iter().map(|(name, _)| name).collect()
    }

    #[test]
    fn options_precede_or_follow_the_name() {
        let expected =
            MapOptions { scale: [2.0, 3.0], offset: [0.5, 0.0], wrap: Wrap::CLAMP, ..Default::default() };
        for operand in [
            "-s 2 3 1 -o 0.5 -clamp on dark wood.png",
            "dark wood.png -s 2 3 1 -o 0.5 -clamp on",
            "-s 2 3 1 dark wood.png -o 0.5 -clamp on",
            "\"dark wood.png\" -s 2 3 -clamp on -o 0.5 # tiles",
            "-S 2 3 -O .5 -Clamp ON 'dark wood.png'",
        ] {
            assert_eq!(options(operand, "dark wood.png"), expected, "{operand}");
            let plain = operand.split(" # ").next().unwrap();
            assert_eq!(plain_name(plain.as_bytes()), b"dark wood.png", "{operand}");
        }
        let height = options("-bm 0.2 -imfchan g h.png", "h.png");
        assert_eq!((height.bump_multiplier, height.channel), (Some(0.2), Some(Channel::Component(1))));
    }

    #[test]
    fn channels_of_scalar_maps() {
        let component = |i| Some(Channel::Component(i));
        let channels = [
            ("r", component(0)),
            ("G", component(1)),
            ("b", component(2)),
            ("M", component(3)),
            ("l", Some(Channel::Luminance)),
            ("z", None),
        ];
        for (letter, channel) in channels {
            for operand in [format!("-imfchan {letter} t.png"), format!("t.png -imfchan {letter}")] {
                let options = options(&operand, "t.png");
                assert_eq!(options.channel, channel, "{operand}");
                assert_eq!(options.unsupported.len(), usize::from(letter == "z"), "{operand}");
            }
        }
        assert_eq!(names("-imfchan x t.png")[0], "x t.png");
    }

    #[test]
    fn options_take_only_valid_values() {
        for operand in
            ["-mm 0 t.png", "-bm t.png", "-clamp t.png", "-imfchan t.png", "-boost t.png", "-s t.png"]
        {
            assert_eq!(names(operand)[0], "t.png", "{operand}");
        }
        assert_eq!(names("-mm 0 1 -blendu off -type sphere t.png")[0], "t.png");
        assert_eq!(options("-mm 0 1 -boost 2 t.png", "t.png").unsupported, ["-mm".into(), "-boost".into()]);
    }

    #[test]
    fn names_may_resemble_options_or_comments() {
        assert_eq!(names("-s.png"), ["-s.png"]);
        assert_eq!(names("-s 2.png"), ["2.png", "-s 2.png"]);
        assert_eq!(names("Map #5.png"), ["Map #5.png", "Map"]);
        assert_eq!(names("t.png -s 2 2 1"), ["t.png -s 2 2 1", "t.png"]);
        assert_eq!(options("Map #5.png -s 4 4", "Map #5.png").scale, [4.0; 2]);
        assert!(names("-colorspace sRGB t.png").contains(&"t.png".to_string()));
        let unknown = options("t.png -gamma 2.2 -s 2 2", "t.png");
        assert_eq!((unknown.scale, unknown.unsupported), ([2.0; 2], vec!["-gamma".into()]));
        assert!(readings(b"  ").is_empty() && Map::of_statement(b"-s 1 1", 1).is_none());
        assert!(readings("-s #a ".repeat(700).as_bytes()).len() <= MOST_READINGS);
    }
}
