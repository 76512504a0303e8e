//! Draws every figure of a report from made-up data, so that each can be looked at.
//!
//! `cargo run --release --example figures` writes `out/report.html` and the pictures to `out/figures`, with an
//! `index.html` beside them.

mod block;
mod candidates;
mod odd;
mod sensor;
mod series;

use misclosure::diagnose::verdict::Verdict;
use misclosure::report::html::Page;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::path::Path;

/// Name and number of images.
const FLIGHTS: [(&str, usize); 4] =
    [("oblique, 50 m", 42), ("nadir, 50 m", 43), ("nadir, 30 m", 16), ("nadir, 70 m", 12)];

struct Noise(ChaCha8Rng);

impl Noise {
    fn normal(&mut self, sigma: f64) -> f64 {
        Normal::new(0.0, sigma).map_or(0.0, |n| n.sample(&mut self.0))
    }
}

fn main() -> anyhow::Result<()> {
    let mut noise = Noise(ChaCha8Rng::seed_from_u64(1));
    let mut page = Page::new("Every figure, from made-up data");
    page.subtitle("Nothing here was measured: the page shows what a report looks like.");
    page.verdict(Verdict::Missing, "focal-time explains what was left over; F(1, 41 210) = 512, p < 1e-300.");
    page.verdict(Verdict::Adequate, "No test is significant at 0.001 over the whole catalogue.");
    page.verdict(Verdict::Unexplained, "A pattern of 240 px wavelength along the rows, 0.08 px high, in all flights.");
    sensor::draw(&mut page, &mut noise);
    block::draw(&mut page, &mut noise);
    series::draw(&mut page, &mut noise);
    candidates::draw(&mut page);
    odd::draw(&mut page);
    page.write(Path::new("out"))?;
    std::fs::write("out/figures/index.html", page.html())?;
    println!("out/report.html");
    Ok(())
}
