//! Bytes of a text file as OBJ and MTL readers want them: decoded, continued lines joined, line by line,
//! word by word. Names stay bytes until somebody shows them; numbers are checked, not guessed.

/// Why bytes cannot be text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Binary;

/// The vertical tab stands for the end of a line that was joined to the next: blank to [`words`], and still
/// counted by [`Lines`].
const JOINED: u8 = 0x0b;

/// Decodes UTF-8 and UTF-16 with or without a byte-order mark, turns lone carriage returns into line ends and
/// joins lines that end in a backslash (not in comments). Ill-formed UTF-8 is kept as it is.
pub(super) fn normalise(mut bytes: Vec<u8>) -> Result<Vec<u8>, Binary> {
    if let Some(decoded) = decode_utf16(&bytes) {
        bytes = decoded;
    } else if bytes.starts_with(&[0xef, 0xbb, 0xbf]) {
        bytes.drain(..3);
    }
    if bytes.contains(&0) {
        return Err(Binary);
    }
    if bytes.contains(&b'\r') {
        end_lines_at_lone_carriage_returns(&mut bytes);
    }
    if bytes.contains(&b'\\') {
        join_continued_lines(&mut bytes);
    }
    Ok(bytes)
}

/// The text in UTF-8, if the bytes are UTF-16: by their mark, or by a zero in one half of the first two pairs.
fn decode_utf16(bytes: &[u8]) -> Option<Vec<u8>> {
    let (start, big_endian) = match *bytes {
        [0xff, 0xfe, ..] => (2, false),
        [0xfe, 0xff, ..] => (2, true),
        [a, 0, b, 0, ..] if a != 0 && b != 0 => (0, false),
        [0, a, 0, b, ..] if a != 0 && b != 0 => (0, true),
        _ => return None,
    };
    let unit = |pair: &[u8]| {
        let pair = [pair[0], pair[1]];
        if big_endian { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) }
    };
    let units = bytes[start..].chunks_exact(2).map(unit);
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    Some(text.into_bytes())
}

fn end_lines_at_lone_carriage_returns(bytes: &mut [u8]) {
    for i in 0..bytes.len() {
        if bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n') {
            bytes[i] = b'\n';
        }
    }
}

fn join_continued_lines(bytes: &mut [u8]) {
    let mut start = 0; // of the logical line
    for end in 0..bytes.len() {
        if bytes[end] != b'\n' {
            continue;
        }
        let line = &bytes[start..end];
        let comment = line.iter().find(|b| !is_blank(**b)) == Some(&b'#');
        let last = line.iter().rposition(|b| !is_blank(*b));
        match last {
            Some(last) if line[last] == b'\\' && !comment => {
                bytes[start + last] = b' ';
                bytes[end] = JOINED;
            }
            _ => start = end + 1,
        }
    }
}

/// Whether a byte separates words.
#[inline]
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | JOINED | 0x0c)
}

/// The lines of normalised text with their numbers in the file.
#[derive(Clone, Debug)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    next: u32,
}

impl<'a> Lines<'a> {
    /// From `text` on, whose first line has the number `first`.
    pub(super) fn new(text: &'a [u8], first: u32) -> Self {
        Self { rest: text, next: first }
    }

    /// The number of the line that comes next.
    pub(super) fn number(&self) -> u32 {
        self.next
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (u32, &'a [u8]);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let mut joined = 0;
        let end = self.rest.iter().position(|&b| {
            joined += u32::from(b == JOINED);
            b == b'\n'
        });
        let end = end.unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        let number = self.next;
        self.next += 1 + joined;
        self.rest = rest.get(1..).unwrap_or_default();
        Some((number, line))
    }
}

/// The words of a line up to a comment.
#[derive(Clone, Debug)]
pub(super) struct Words<'a>(&'a [u8]);

/// The words of `line` up to a comment.
#[inline]
pub(super) fn words(line: &[u8]) -> Words<'_> {
    Words(line)
}

impl<'a> Words<'a> {
    /// All that follows the words taken so far and one blank, to the end of the line: an operand that holds a name.
    pub(super) fn rest(self) -> &'a [u8] {
        let rest = self.0.split_first().map_or(self.0, |(_, rest)| rest);
        rest.strip_suffix(b"\r").unwrap_or(rest)
    }
}

/// Without blanks at its ends.
pub(super) fn trimmed(mut text: &[u8]) -> &[u8] {
    while let [first, tail @ ..] = text
        && is_blank(*first)
    {
        text = tail;
    }
    while let [head @ .., last] = text
        && is_blank(*last)
    {
        text = head;
    }
    text
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.0.iter().position(|&b| !is_blank(b))?;
        let line = &self.0[start..];
        if line[0] == b'#' {
            self.0 = &[];
            return None;
        }
        let end = line.iter().position(|&b| is_blank(b)).unwrap_or(line.len());
        let (word, rest) = line.split_at(end);
        self.0 = rest;
        Some(word)
    }
}

/// What a word is as a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Numeral {
    /// Sign, digits with a point somewhere, exponent: what `f64::from_str` reads.
    Finite,
    /// NaN or infinity in one of the spellings that programs write.
    NotFinite,
    /// Something else.
    Malformed,
}

/// Checks the spelling of a number without reading it.
#[inline]
pub(super) fn numeral(word: &[u8]) -> Numeral {
    let digits = |at: usize| word[at..].iter().take_while(|b| b.is_ascii_digit()).count();
    let sign = |at: usize| usize::from(matches!(word.get(at), Some(b'+' | b'-')));
    let mut at = sign(0);
    let whole = digits(at);
    at += whole;
    let mut fraction = 0;
    if word.get(at) == Some(&b'.') {
        fraction = digits(at + 1);
        at += 1 + fraction;
    }
    if whole + fraction > 0 && matches!(word.get(at), Some(b'e' | b'E')) {
        let exponent = at + 1 + sign(at + 1);
        let length = digits(exponent);
        at = if length > 0 { exponent + length } else { at };
    }
    if whole + fraction > 0 && at == word.len() { Numeral::Finite } else { not_finite(word) }
}

#[cold]
fn not_finite(word: &[u8]) -> Numeral {
    let lower = String::from_utf8_lossy(word).to_ascii_lowercase();
    let bare = lower.trim_start_matches(['+', '-']);
    // `1.#QNAN`, `-1.#IND00` and the like are what older C libraries print.
    match bare.starts_with("nan") || bare.starts_with("inf") || bare.starts_with("1.#") {
        true => Numeral::NotFinite,
        false => Numeral::Malformed,
    }
}

/// Whether a well-formed number is zero: no digit but 0 before its exponent.
#[inline]
pub(super) fn is_zero(word: &[u8]) -> bool {
    let mantissa = word.iter().take_while(|b| !matches!(b, b'e' | b'E'));
    mantissa.clone().all(|b| !matches!(b, b'1'..=b'9' | b'n'))
}

/// Reads a number; `None` where it is malformed or not finite.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let text = core::str::from_utf8(word).ok()?;
    (numeral(word) == Numeral::Finite).then(|| text.parse().ok()).flatten().filter(|x: &f64| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<(u32, String)> {
        let text = normalise(text.as_bytes().to_vec()).unwrap();
        Lines::new(&text, 1)
            .map(|(n, l)| (n, words(l).map(String::from_utf8_lossy).collect::<Vec<_>>().join(" ")))
            .collect()
    }

    #[test]
    fn line_ends_marks_and_continuations() {
        let expected = [(1, "v 1 2 3".to_string()), (3, "f 1".into()), (4, "".into()), (5, "x".into())];
        assert_eq!(lines("\u{feff}v 1 \\\n 2 3\nf 1\n# c \\\nx"), expected);
        assert_eq!(lines("v 1 \\\r\n 2 3\r\nf 1\r\n# c \\\r\nx"), expected);
        assert_eq!(lines("v 1 \\\r 2 3\rf 1\r# c \\\rx"), expected);
    }

    #[test]
    fn utf16_is_decoded_and_binary_refused() {
        let little: Vec<u8> = "v 1".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = "\u{feff}v 1".encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert_eq!(normalise(little).unwrap(), b"v 1");
        assert_eq!(normalise(big).unwrap(), b"v 1");
        assert_eq!(normalise(vec![b'v', 7, 0, 0, 9]), Err(Binary));
    }

    #[test]
    fn spelling_of_numbers() {
        for good in ["0", "-1", "+1", "2.", ".5", "1e5", "1.5E-3", "3.1e+2"] {
            assert_eq!(numeral(good.as_bytes()), Numeral::Finite, "{good}");
            assert!(good.parse::<f64>().is_ok());
        }
        for odd in ["nan", "-NaN(ind)", "inf", "1.#QNAN", "-1.#IND"] {
            assert_eq!(numeral(odd.as_bytes()), Numeral::NotFinite, "{odd}");
        }
        for bad in ["", "-", ".", "1,5", "3.1+e2", "1e", "e5", "0x10", "1.2.3", "--1"] {
            assert_eq!(numeral(bad.as_bytes()), Numeral::Malformed, "{bad}");
        }
        assert_eq!(number(b"1e999"), None);
    }

    #[test]
    fn operands_are_what_stands_there() {
        let mut line = words(b"usemtl  dark  wood #3 # old \r");
        assert_eq!(line.next(), Some(&b"usemtl"[..]));
        assert_eq!(line.clone().rest(), b" dark  wood #3 # old ");
        assert_eq!(trimmed(line.rest()), b"dark  wood #3 # old");
        assert_eq!(words(b"").rest(), b"");
    }
}
