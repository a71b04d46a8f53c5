//! Figures and names as people read them.

use std::borrow::Cow;

/// Thin enough not to look like two numbers, and no line breaks at it.
const GROUP: char = '\u{202f}';

/// A count, in groups of three digits.
pub(crate) fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(GROUP);
        }
        text.push(digit);
    }
    text
}

/// A size.
pub(crate) fn bytes(size: u64) -> String {
    let units = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = size as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < units.len() {
        value /= 1024.0;
        unit += 1;
    }
    let text =
        if unit == 0 || value >= 100.0 { format!("{value:.0}") } else { format!("{value:.1}") };
    format!("{text}{GROUP}{}", units[unit])
}

/// A time.
pub(crate) fn seconds(time: f64) -> String {
    let whole = time.max(0.0).round() as u64;
    match whole {
        0..10 => format!("{time:.2}{GROUP}s"),
        10..120 => format!("{time:.1}{GROUP}s"),
        120..7200 => format!("{}:{:02}{GROUP}min", whole / 60, whole % 60),
        _ => format!("{}:{:02}{GROUP}h", whole / 3600, whole % 3600 / 60),
    }
}

/// A measure, with as many digits as it takes.
pub(crate) fn decimal(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e6).contains(&size) {
        let digits = (4 - size.log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{value:.digits$}");
        let text = if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.')
        } else {
            &text
        };
        text.to_owned()
    } else {
        format!("{value:.3e}")
    }
}

/// A moment, in UTC.
pub(crate) fn date(ms_since_1970: u64) -> String {
    let time = i64::try_from(ms_since_1970).ok().map(jiff::Timestamp::from_millisecond);
    match time {
        Some(Ok(time)) => time.strftime("%Y-%m-%d %H:%M:%S UTC").to_string(),
        _ => "at no date".to_owned(),
    }
}

/// Text with what cannot be seen, or turns around what can, shown as a sign.
pub(crate) fn visible(text: &str) -> Cow<'_, str> {
    let turns = |c: char| {
        matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
            || matches!(c, '\u{fdd0}'..='\u{fdef}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}')
    };
    let hides = |c: char| c.is_control() || turns(c);
    if !text.chars().any(hides) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| match c as u32 {
        code @ 0..0x20 => char::from_u32(0x2400 + code).unwrap_or('\u{fffd}'),
        0x7f => '\u{2421}',
        _ if hides(c) => '\u{fffd}',
        _ => c,
    };
    Cow::Owned(text.chars().map(shown).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short() {
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(count(12), "12");
        assert_eq!(bytes(1536), "1.5\u{202f}KiB");
        assert_eq!(bytes(999), "999\u{202f}B");
        assert_eq!(seconds(3.256), "3.26\u{202f}s");
        assert_eq!(seconds(3700.0), "61:40\u{202f}min");
        assert_eq!(decimal(0.125), "0.125");
        assert_eq!(decimal(1234.0), "1234");
        assert_eq!(decimal(1e-9), "1.000e-9");
        assert_eq!(date(0), "1970-01-01 00:00:00 UTC");
        assert_eq!(date(u64::MAX), "at no date");
    }

    #[test]
    fn what_is_hidden_is_shown() {
        assert_eq!(visible("a b"), "a b");
        assert_eq!(visible("a\n\u{202e}b\u{7f}"), "a\u{240a}\u{fffd}b\u{2421}");
    }
}
