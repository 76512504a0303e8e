//! Times as EXIF and XMP write them.

/// Seconds since 1970 of `2024:05:01 10:20:30`, with `-` for `:`, with `T` for the blank, with a fraction or without.
/// `sub_second` are the digits after the point, of which leading zeros count.
pub(super) fn seconds(text: &str, sub_second: Option<&str>) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    let (date, time) = text.split_once([' ', 'T'])?;
    let [year, month, day] = whole(date, [':', '-'])?;
    let (clock, fraction) = time.split_once('.').unwrap_or((time, ""));
    let [hour, minute, second] = whole(clock, [':', ':'])?;
    let is_time = (1..=12).contains(&month) && (1..=31).contains(&day) && hour < 24 && minute < 60 && second <= 60;
    if !is_time || year < 1970 {
        return None;
    }
    let digits = if fraction.is_empty() { sub_second.unwrap_or_default().trim() } else { fraction };
    if !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let part: f64 = if digits.is_empty() { 0.0 } else { format!("0.{digits}").parse().ok()? };
    Some((days(year, month, day) * 86_400 + hour * 3600 + minute * 60 + second) as f64 + part)
}

/// Seconds of `+02:00`.
pub(super) fn offset(text: &str) -> Option<f64> {
    let text = text.trim();
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    let (hours, minutes) = text.trim_start_matches(['+', '-']).split_once(':')?;
    let [hours, minutes]: [i64; 2] = [hours.parse().ok()?, minutes.parse().ok()?];
    ((0..24).contains(&hours) && (0..60).contains(&minutes)).then_some(sign * (hours * 3600 + minutes * 60) as f64)
}

fn whole(text: &str, separators: [char; 2]) -> Option<[i64; 3]> {
    let parts: Vec<i64> = text.split(separators).map(|part| part.parse().ok()).collect::<Option<_>>()?;
    <[i64; 3]>::try_from(parts).ok().filter(|parts| parts.iter().all(|part| (0..10_000).contains(part)))
}

/// Days since 1970 of a date of the Gregorian calendar.
fn days(year: i64, month: i64, day: i64) -> i64 {
    // Years begin in March: the leap day is their last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let day_of_year = (153 * month + 2) / 5 + day - 1;
    365 * year + year / 4 - year / 100 + year / 400 + day_of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leading_zeros_of_the_fraction_count() {
        // 1 000 000 000 s after 1970.
        assert_eq!(seconds("2001:09:09 01:46:40", None), Some(1e9));
        assert_eq!(seconds("2001:09:09 01:46:40", Some("057")), Some(1e9 + 0.057));
        assert_eq!(seconds("2001:09:09 01:46:40", Some("57 ")), Some(1e9 + 0.57));
        assert_eq!(seconds("2001-09-09T01:46:40.250Z", None), Some(1e9 + 0.25));
        assert_eq!(seconds("2024:03:01 00:00:00", None), seconds("2024:02:29 00:00:00", None).map(|t| t + 86_400.0));
        assert_eq!(offset("-03:30"), Some(-12_600.0));
    }

    #[test]
    fn what_is_no_time_is_none() {
        for text in [
            "",
            "0000:00:00 00:00:00",
            "2001:13:09 01:46:40",
            "2001:09:09",
            "    :  :     :  :  ",
            "2001:09:09 01:46:40.x",
        ] {
            assert_eq!(seconds(text, None), None, "{text}");
        }
        assert_eq!(seconds("2001:09:09 01:46:40", Some("é")), None);
    }
}
