//! What chance does to a file: bytes flipped, cut and inserted, lines twice or gone, numbers of any size.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Changes of one input at most.
const MOST_CHANGES: usize = 4;
/// Bytes that are cut or inserted at most.
const MOST_BYTES: usize = 40;

/// In place of a number.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "1e12",
    "1e400",
    "nan",
    "inf",
    "18446744073709551616",
    "4294967295",
    "0.5",
    "",
    "\"text\"",
];

/// A changed copy.
pub fn mutate(seed: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..random.random_range(1..=MOST_CHANGES) {
        if bytes.is_empty() {
            break;
        }
        let at = random.random_range(0..bytes.len());
        match random.random_range(0..6) {
            0 => bytes[at] ^= 1 << random.random_range(0..8),
            1 => drop(bytes.drain(at..bytes.len().min(at + random.random_range(1..=MOST_BYTES)))),
            2 => drop(bytes.splice(at..at, (0..random.random_range(1..=MOST_BYTES)).map(|_| random.random::<u8>()))),
            3 => {
                let line = line_at(&bytes, at);
                let copy = bytes[line.clone()].to_vec();
                bytes.splice(line.start..line.start, copy);
            }
            4 => drop(bytes.drain(line_at(&bytes, at))),
            _ => {
                let number = number_from(&bytes, at);
                let text = NUMBERS[random.random_range(0..NUMBERS.len())];
                bytes.splice(number, text.bytes());
            }
        }
    }
    bytes
}

/// The line around `at`, its end included.
fn line_at(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let start = bytes[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let end = bytes[at..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |end| at + end + 1);
    start..end
}

/// The first number at or after `at`; nothing at the end where there is none.
fn number_from(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b".-+e".contains(byte);
    let start = bytes[at..].iter().position(u8::is_ascii_digit).map_or(bytes.len(), |start| at + start);
    let end = bytes[start..].iter().position(|byte| !is_part(byte)).map_or(bytes.len(), |end| start + end);
    start..end
}
