//! Numbers as people read them.

/// A number with six digits that count.
pub fn short(x: f64) -> String {
    let most = x.abs();
    if most == 0.0 || !most.is_finite() {
        return format!("{x}");
    }
    if !(1e-4..1e9).contains(&most) {
        return format!("{x:.5e}");
    }
    let decimals = (5 - most.log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{x:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_in_six_digits() {
        for (x, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-2.5, "-2.5"),
            (1234.56789, "1234.57"),
            (100.0, "100"),
            (123_456_789.0, "123456789"),
            (0.000_123_456_78, "0.000123457"),
            (1.5e-7, "1.50000e-7"),
        ] {
            assert_eq!(short(x), text);
        }
    }
}
