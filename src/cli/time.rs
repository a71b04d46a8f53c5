//! Times as people give them: how long, and until when.

use jiff::ZonedDateTime;
use jiff::civil::Time;

/// Milliseconds of a time such as 90s, 10m or 2h.
pub fn parse_time(text: &str) -> Result<u64, String> {
    let refuse = || format!("expected a time such as 90s, 10m or 2h, found {text:?}");
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let number: f64 = number.parse().map_err(|_| refuse())?;
    let seconds = match unit.trim() {
        "ms" => 0.001,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        "d" => 86400.0,
        _ => return Err(refuse()),
    };
    Ok((number * seconds * 1000.0) as u64)
}

/// A time of the day.
pub fn parse_clock(text: &str) -> Result<Time, String> {
    let refuse = || format!("expected a time of the day such as 06:00, found {text:?}");
    let full = if text.find(':') == Some(1) { format!("0{text}") } else { text.to_owned() };
    if !full.contains(':') {
        return Err(refuse());
    }
    full.parse().map_err(|_| refuse())
}

/// The next moment at which clocks show `time` where `now` is, milliseconds since 1970. Where the
/// clocks are set forward over it, that is an hour later; where they show it twice, the first.
pub fn next_at(now: &ZonedDateTime, time: Time) -> u64 {
    let on = |date: jiff::civil::Date| {
        date.to_datetime(time).to_zoned_datetime(now.time_zone().clone()).ok()
    };
    let today = on(now.date()).filter(|moment| moment > now);
    let next = today.or_else(|| on(now.date().tomorrow().ok()?));
    let ms = next.map_or(i64::MAX, |moment| moment.timestamp().as_millisecond());
    u64::try_from(ms).unwrap_or(0)
}

/// So many seconds, as people say it of what is only expected.
pub fn approximately(seconds: f64) -> String {
    let seconds = seconds.max(0.0);
    let minutes = (seconds / 60.0).round();
    match (seconds, minutes) {
        _ if !seconds.is_finite() => "a very long time".to_owned(),
        (..100.0, _) => format!("{seconds:.0} s"),
        (_, ..100.0) => format!("{minutes:.0} min"),
        _ => format!("{} h {} min", (minutes / 60.0).floor(), minutes % 60.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_times_are_said_in_larger_units() {
        let said = [0.4, 99.4, 100.0, 5900.0, 6000.0, f64::INFINITY].map(approximately);
        let expected = ["0 s", "99 s", "2 min", "98 min", "1 h 40 min", "a very long time"];
        assert_eq!(said, expected);
    }

    #[test]
    fn times_have_units() {
        assert_eq!(parse_time("90s"), Ok(90_000));
        assert_eq!(parse_time("1.5h"), Ok(5_400_000));
        assert!(parse_time("soon").is_err());
    }

    #[test]
    fn a_time_of_the_day_is_today_or_tomorrow() {
        let zone = jiff::tz::TimeZone::fixed(jiff::tz::offset(2));
        let now: ZonedDateTime = "2026-03-01T22:30"
            .parse::<jiff::civil::DateTime>()
            .expect("a date")
            .to_zoned_datetime(zone)
            .expect("a moment");
        let at = |text: &str| {
            let ms = next_at(&now, parse_clock(text).expect("a time")) as i64;
            let moment = jiff::Timestamp::from_millisecond(ms).expect("a moment");
            moment.to_zoned_datetime(now.time_zone().clone()).strftime("%d %H:%M").to_string()
        };
        assert_eq!(at("06:00"), "02 06:00");
        assert_eq!(at("6:00"), "02 06:00");
        assert_eq!(at("22:31"), "01 22:31");
        assert_eq!(at("22:30"), "02 22:30", "now is over");
        for wrong in ["6", "25:00", "soon", "06:00 tomorrow"] {
            assert!(parse_clock(wrong).is_err(), "{wrong}");
        }
    }
}
