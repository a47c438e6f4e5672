//! Numbers and foreign text on the page.

use crate::stamp::Stamp;

/// `text` with everything escaped that means something in HTML, also inside
/// attributes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && c != '\n' && c != '\t' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// JSON that may stand inside a `<script>` element: it can neither end the
/// element nor open a comment in it.
pub fn script_safe(json: &str) -> String {
    // Outside of strings JSON has none of these letters.
    json.replace('&', "\\u0026").replace('<', "\\u003c").replace('>', "\\u003e")
}

/// Milliseconds with three meaningful digits.
pub fn ms(value: f64) -> String {
    let decimals = usize::from(value < 10.0) + usize::from(value < 100.0);
    format!("{value:.decimals$}")
}

/// A length: centimetres below a metre.
pub fn metres(value: f64) -> String {
    if value < 1.0 { format!("{:.1} cm", value * 100.0) } else { format!("{value:.2} m") }
}

/// A share as a percentage.
pub fn percent(value: f64) -> String {
    let percent = value * 100.0;
    if percent > 0.0 && percent < 9.95 {
        format!("{percent:.1} %")
    } else {
        format!("{percent:.0} %")
    }
}

/// A value that may be missing.
pub fn or_dash<T>(value: Option<T>, text: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), text)
}

/// `1 frame`, `2 frames`.
pub fn count(number: u64, noun: &str) -> String {
    if number == 1 { format!("1 {noun}") } else { format!("{number} {noun}s") }
}

/// `#rrggbb`.
pub fn hex(color: [u8; 3]) -> String {
    let [r, g, b] = color;
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Date and time in UTC of a stamp that counts from 1970, `None` for one that
/// evidently counts from something else (before 2001).
pub fn utc(stamp: Stamp) -> Option<String> {
    let seconds = i64::from(stamp.sec());
    if seconds < 978_307_200 {
        return None;
    }
    // Days to civil date in the proleptic Gregorian calendar, by 400-year eras
    // of 146097 days counted from 0000-03-01.
    let days = seconds.div_euclid(86_400) + 719_468;
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = days.div_euclid(146_097) * 400 + year_of_era + i64::from(month <= 2);
    let (hour, minute) = (seconds.rem_euclid(86_400) / 3600, seconds.rem_euclid(3600) / 60);
    let second = seconds.rem_euclid(60);
    Some(format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02} UTC"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_of_known_stamps() {
        for (seconds, expected) in [
            (951_782_400, None), // 2000-02-29
            (978_307_200, Some("2001-01-01 00:00:00 UTC")),
            (1_709_208_000, Some("2024-02-29 12:00:00 UTC")),
            (1_735_689_599, Some("2024-12-31 23:59:59 UTC")),
            (2_147_483_647, Some("2038-01-19 03:14:07 UTC")),
        ] {
            assert_eq!(utc(Stamp::from_parts(seconds, 0)).as_deref(), expected);
        }
    }

    #[test]
    fn script_safe_json_is_the_same_json() {
        let value = serde_json::json!({ "</script><!--": "a & b \u{2028} <b>" });
        let text = script_safe(&value.to_string());
        assert!(!text.contains('<') && !text.contains('&'));
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }
}
