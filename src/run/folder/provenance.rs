//! Where a run comes from: date, version, command, coordinate system. A report that is handed on must say it.

use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::sync::OnceLock;
use std::time::{SystemTime, UNIX_EPOCH};

/// Its keys in `source.json`; each may be missing in a folder of an older version.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// UTC, `2026-01-31T12:00:00Z`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub written: Option<String>,
    /// Version of this program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
    /// The command line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// Coordinate system of the block.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crs: Option<String>,
}

/// The command line, where it is not the one with which the process was started.
static COMMAND: OnceLock<Vec<OsString>> = OnceLock::new();

/// States the command line that runs of this process record: options may come from a file. Only the first one counts.
pub(crate) fn state_command(line: Vec<OsString>) {
    COMMAND.get_or_init(|| line);
}

impl Provenance {
    /// Of this process, now.
    pub(super) fn now(crs: &str) -> Self {
        let line = COMMAND.get().cloned().unwrap_or_else(|| std::env::args_os().collect());
        Self {
            written: Some(utc(seconds())),
            version: Some(env!("CARGO_PKG_VERSION").into()),
            command: Some(command(line.into_iter().map(|argument| argument.to_string_lossy().into_owned()))),
            crs: Some(crs.into()),
        }
    }
}

/// Since 1970. `SOURCE_DATE_EPOCH` takes the place of the clock, for runs that are to be the same byte by byte.
fn seconds() -> u64 {
    let given = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok());
    given.unwrap_or_else(|| SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

/// Date and time of the proleptic Gregorian calendar (Hinnant, chrono-compatible low-level date algorithms).
fn utc(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // Days since 1 March of year 0: leap days are then at the end of a year.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest / 60 % 60, rest % 60)
}

/// The command as one would type it: the program without its folder, words with blanks in quotes.
fn command(mut arguments: impl Iterator<Item = String>) -> String {
    let program = arguments.next().unwrap_or_default();
    let program = program.rsplit('/').next().unwrap_or_default().to_string();
    let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%~".contains(c);
    let word = |word: String| match !word.is_empty() && word.chars().all(plain) {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    };
    std::iter::once(program).chain(arguments.map(word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(utc(0), "1970-01-01T00:00:00Z");
        assert_eq!(utc(951_782_399), "2000-02-28T23:59:59Z");
        assert_eq!(utc(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(utc(1_767_225_599), "2025-12-31T23:59:59Z");
        assert_eq!(utc(4_107_542_400), "2100-03-01T00:00:00Z");
    }

    #[test]
    fn a_command_can_be_typed_again() {
        let words = ["/usr/bin/misclosure", "improve", "my block", "-o", "it's"].map(String::from);
        assert_eq!(command(words.into_iter()), r"misclosure improve 'my block' -o 'it'\''s'");
    }
}
