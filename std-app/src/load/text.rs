//! Text of OBJ and MTL files: decoded, with continued lines joined, then lines and words. Names stay bytes
//! until they are shown.

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE};

/// The bytes are not text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Binary;

/// Replaces the end of a line that continues: blank to [`words`], but counted by [`Lines`]. The vertical tab.
const JOINED: u8 = 0x0b;

/// Statements whose operand is a name. It keeps a backslash at its end, which may be the second byte of a
/// character in Shift-JIS, Big5 or GBK.
const NAMING: &str = "bump call csh decal disp g maplib mtllib newmtl norm o refl s usemap usemtl";

/// Other statements of OBJ and MTL files: a line that begins with one does not continue the line before.
const OTHERS: &str = "aniso anisor bevel bmat c_interp con cstype ctech curv curv2 d d_interp deg end f fo hole illum \
    ka kd ke ks l lod mg ni ns p parm pc pcr pm pr ps scrv shadow_obj sharpness sp stech step surf \
    tf tr trace_obj trim v vn vp vt";

/// Decodes UTF-8 and UTF-16 with or without a byte-order mark, turns lone carriage returns into line ends and
/// joins lines that end in a backslash, except comments and names. Ill-formed UTF-8 is kept.
pub(super) fn normalise(mut bytes: Vec<u8>) -> Result<Vec<u8>, Binary> {
    if let Some(encoding) = utf16(&bytes) {
        bytes = encoding.decode_with_bom_removal(&bytes).0.into_owned().into_bytes();
    } else if bytes.starts_with(&[0xef, 0xbb, 0xbf]) {
        bytes.drain(..3);
    }
    if bytes.contains(&0) {
        return Err(Binary);
    }
    if bytes.contains(&b'\r') {
        for i in 0..bytes.len() {
            if bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n') {
                bytes[i] = b'\n';
            }
        }
    }
    if bytes.contains(&b'\\') {
        join_continued_lines(&mut bytes);
    }
    Ok(bytes)
}

/// The byte order of UTF-16, which has a byte-order mark, or a zero in the same half of the first two pairs.
fn utf16(bytes: &[u8]) -> Option<&'static Encoding> {
    match *bytes {
        [0xff, 0xfe, ..] => Some(UTF_16LE),
        [0xfe, 0xff, ..] => Some(UTF_16BE),
        [a, 0, b, 0, ..] if a != 0 && b != 0 => Some(UTF_16LE),
        [0, a, 0, b, ..] if a != 0 && b != 0 => Some(UTF_16BE),
        _ => None,
    }
}

/// Joins a line that ends in a backslash with the next one, unless that is a statement of its own. A
/// backslash that ends a comment or a word of a name continues nothing.
fn join_continued_lines(bytes: &mut [u8]) {
    let mut start = 0;
    // True if the statement of the joined lines so far has a name; `None` before its first word.
    let mut has_name = None;
    while start < bytes.len() {
        let end = line_end(bytes, start);
        let line = &bytes[start..end];
        let last = line.iter().rposition(|b| !is_blank(*b)).filter(|&last| line[last] == b'\\');
        let last = last.filter(|_| !word_starts(line).any(|at| line[at] == b'#'));
        let mut is_joined = false;
        if let Some(last) = last {
            has_name = has_name.or_else(|| words(line).next().map(|word| is_one_of(word, NAMING)));
            let (names, is_word) = (has_name == Some(true), last == 0 || is_blank(line[last - 1]));
            let next = bytes.get(end + 1..line_end(bytes, end + 1)).unwrap_or_default();
            let is_last = end == bytes.len() || words(next).next().is_some_and(begins_statement);
            is_joined = !is_last && (is_word || !names);
            if is_joined || !names {
                bytes[start + last] = b' ';
            }
        }
        if is_joined {
            bytes[end] = JOINED;
        } else {
            has_name = None;
        }
        start = end + 1;
    }
}

/// Index of the first line end from `start` on.
fn line_end(bytes: &[u8], start: usize) -> usize {
    let rest = bytes.get(start..).unwrap_or_default();
    rest.iter().position(|&b| b == b'\n').map_or(bytes.len(), |at| start + at)
}

fn begins_statement(word: &[u8]) -> bool {
    is_one_of(word, NAMING) || is_one_of(word, OTHERS)
}

/// True if `word` is one of `keywords`, in any case, or the keyword of a map.
fn is_one_of(word: &[u8], keywords: &str) -> bool {
    word.get(..4).is_some_and(|start| start.eq_ignore_ascii_case(b"map_"))
        || keywords.split(' ').any(|keyword| word.eq_ignore_ascii_case(keyword.as_bytes()))
}

/// True if a byte separates words.
#[inline]
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | JOINED | 0x0c)
}

/// Lines of normalised text with their numbers in the file.
#[derive(Clone, Debug)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    next: u32,
}

impl<'a> Lines<'a> {
    /// Lines of `text`, numbered from `first`.
    pub(super) fn new(text: &'a [u8], first: u32) -> Self {
        Self { rest: text, next: first }
    }

    /// Number of the next line.
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
        let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        let number = self.next;
        self.next += 1 + joined;
        self.rest = rest.get(1..).unwrap_or_default();
        Some((number, line))
    }
}

/// Words of a line up to a comment.
#[derive(Clone, Debug)]
pub(super) struct Words<'a>(&'a [u8]);

/// Words of `line` up to a comment.
#[inline]
pub(super) fn words(line: &[u8]) -> Words<'_> {
    Words(line)
}

impl<'a> Words<'a> {
    /// The line after the words taken so far and one blank: an operand that holds a name.
    pub(super) fn rest(self) -> &'a [u8] {
        let rest = self.0.split_first().map_or(self.0, |(_, rest)| rest);
        rest.strip_suffix(b"\r").unwrap_or(rest)
    }
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

/// Starts of the words of an operand, in which `#` begins no comment.
pub(super) fn word_starts(operand: &[u8]) -> impl Iterator<Item = usize> {
    (0..operand.len()).filter(|&i| !is_blank(operand[i]) && (i == 0 || is_blank(operand[i - 1])))
}

/// The text without blanks at its ends.
pub(super) fn trimmed(text: &[u8]) -> &[u8] {
    let start = text.iter().position(|b| !is_blank(*b)).unwrap_or(text.len());
    let end = text.iter().rposition(|b| !is_blank(*b)).map_or(start, |last| last + 1);
    &text[start..end]
}

/// The value of a number: sign, digits with a point anywhere, exponent. NaN for NaN and infinity in any of
/// the spellings of other programs; infinite if it is too large for f64; `None` if it is malformed.
#[inline]
pub(super) fn parse_number(word: &[u8]) -> Option<f64> {
    let is_decimal = |byte: &u8| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E');
    match word.iter().all(is_decimal) {
        true => core::str::from_utf8(word).ok()?.parse().ok(),
        false => not_finite(word),
    }
}

#[cold]
fn not_finite(word: &[u8]) -> Option<f64> {
    let lower = String::from_utf8_lossy(word).to_ascii_lowercase();
    let bare = lower.trim_start_matches(['+', '-']);
    // Older C libraries print `1.#QNAN`, `-1.#IND00` and the like.
    ["nan", "inf", "1.#"].iter().any(|spelling| bare.starts_with(spelling)).then_some(f64::NAN)
}

/// The value of a finite number; `None` for anything else.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    parse_number(word).filter(|value| value.is_finite())
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
    fn line_ends_byte_order_marks_and_continuations() {
        let expected = [(1, "v 1 2 3".to_string()), (3, "f 1".into()), (4, "".into()), (5, "x".into())];
        assert_eq!(lines("\u{feff}v 1 \\\n 2 3\nf 1\n# c \\\nx"), expected);
        assert_eq!(lines("v 1 \\\r\n 2 3\r\nf 1\r\n# c \\\r\nx"), expected);
        assert_eq!(lines("v 1 \\\r 2 3\rf 1\r# c \\\rx"), expected);
    }

    #[test]
    fn numbers_and_lists_continue_and_comments_and_names_do_not() {
        let joined = [
            "f 1 2\\\n 3",
            "f 1 \\  \n 2 \\\t\r\n3",
            "v 1\\\r2\\\r3",
            "Kd .5 \\\n.5 .5",
            "mtllib a.mtl \\\nb.mtl",
            "map_Kd -s 1 1 1 \\\n t.png",
            "g a \\\n b",
        ];
        for text in joined {
            let parts: Vec<&str> =
                text.split(['\\', '\n', '\r', ' ', '\t']).filter(|w| !w.is_empty()).collect();
            assert_eq!(lines(text), [(1, parts.join(" "))], "{text:?}");
        }
        let apart = [
            "v 1 2 3 # C:\\models\\",
            "v 1 2 3 #\\",
            "# C:\\models\\",
            "  # \\",
            "Kd 1 1 1 # \\",
            "usemtl wood\\",
            "newmtl 1 2\\  ",
            "MAP_KD textures\\",
            "map_Kd Map #5\\",
            "usemtl a # old \\",
            "usemtl a \\",
            "o C:\\",
        ];
        for text in apart {
            for end in ["\n", "\r\n", "\r"] {
                let read = lines(&format!("{text}{end}v 1 2 3{end}usemtl b"));
                let rest = [(2, "v 1 2 3".to_string()), (3, "usemtl b".into())];
                assert_eq!(read[1..], rest, "{text:?} {end:?}");
            }
        }
        let name = |text: &[u8]| {
            let text = normalise(text.to_vec()).unwrap();
            let (_, line) = Lines::new(&text, 1).next().unwrap();
            let mut words = words(line);
            words.next();
            words.rest().to_vec()
        };
        for bytes in [&b"\x95\x5c"[..], b"a \x83\x5c", b"\xa5\x5c", b"wood\\", b"a \\"] {
            assert_eq!(name(&[b"usemtl ", bytes, b"\nf 1 2 3\n"].concat()), bytes);
        }
    }

    #[test]
    fn backslash_before_a_statement_or_the_end_means_nothing() {
        let expected = [(1, "f 1 2 3".to_string()), (2, "f 4 5 6".into())];
        assert_eq!(lines("f 1 2 3 \\\nf 4 5 6\\"), expected);
        assert_eq!(lines("f 1 2 3\\\r\nf 4 5 6 \\\r\n"), expected);
        let many = format!("f {}1 2 3", "\\\n".repeat(100_000));
        assert_eq!(lines(&many), [(1, "f 1 2 3".to_string())]);
    }

    #[test]
    fn utf16_is_decoded_and_binary_is_refused() {
        let little: Vec<u8> = "v 1".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = "\u{feff}v 1".encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert_eq!(normalise(little).unwrap(), b"v 1");
        assert_eq!(normalise(big).unwrap(), b"v 1");
        assert_eq!(normalise(vec![b'v', 7, 0, 0, 9]), Err(Binary));
    }

    #[test]
    fn spellings_of_numbers() {
        for good in ["0", "-1", "+1", "2.", ".5", "1e5", "1.5E-3", "3.1e+2"] {
            assert_eq!(parse_number(good.as_bytes()), good.parse().ok(), "{good}");
        }
        for odd in ["nan", "-NaN(ind)", "inf", "1.#QNAN", "-1.#IND"] {
            assert!(parse_number(odd.as_bytes()).is_some_and(f64::is_nan), "{odd}");
        }
        for bad in ["", "-", ".", "1,5", "3.1+e2", "1e", "e5", "0x10", "1.2.3", "--1"] {
            assert_eq!(parse_number(bad.as_bytes()), None, "{bad}");
        }
        assert_eq!((parse_number(b"1e999"), number(b"1e999")), (Some(f64::INFINITY), None));
    }

    #[test]
    fn operands_keep_blanks_and_comments() {
        let mut line = words(b"usemtl  dark  wood #3 # old \r");
        assert_eq!(line.next(), Some(&b"usemtl"[..]));
        assert_eq!(line.clone().rest(), b" dark  wood #3 # old ");
        assert_eq!(trimmed(line.rest()), b"dark  wood #3 # old");
        assert_eq!(words(b"").rest(), b"");
    }
}
