//! How time and memory grow with an area: part of `make bench`, or `cargo bench --bench areal`. A number behind `--` is
//! the most images. The areas are those of `benches/solvers/areal.toml`, enlarged in both directions, with
//! noise and nothing else; the program adjusts each with the native solver and diagnoses it, on two threads.

use anyhow::{Context, Result, ensure};
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_misclosure");
const SCENARIO: &str = include_str!("solvers/areal.toml");
/// Factors on both sides of the area: some 730, 1,500, 5,000 and 20,000 images.
const FACTORS: [f64; 4] = [1.0, 1.43, 2.63, 5.26];
/// Images and tie points of the smallest area.
const IMAGES: f64 = 731.0;
const POINTS: f64 = 60_000.0;
const SEED: &str = "8";
/// How often memory is looked at.
const LOOK: Duration = Duration::from_millis(50);
const TASKS: [&str; 2] = ["adjust", "diagnose"];
const COMMANDS: [&[&str]; 2] = [&["adjust", "--solver", "native"], &["diagnose"]];

fn main() -> Result<()> {
    let most = match std::env::args().skip(1).find(|argument| argument != "--bench") {
        Some(text) => text.parse().with_context(|| format!("{text}: expected a number of images"))?,
        None => f64::INFINITY,
    };
    let mut table = Table::new("").number("images", "").number("measurements", "");
    for task in TASKS {
        table = table.number(task, "s").number("memory", "GB");
    }
    let mut ends: Vec<(f64, [Spent; 2])> = Vec::new();
    for factor in FACTORS.into_iter().filter(|factor| IMAGES * factor * factor <= most * 1.05) {
        let folder = tempfile::tempdir()?;
        let block = folder.path().join("area");
        simulate(factor, folder.path(), &block)?;
        let count =
            |file: &str| Ok::<_, std::io::Error>(std::fs::read_to_string(block.join(file))?.lines().count() - 1);
        let (images, measurements) = (count("images.csv")?, count("ties.csv")?);
        let mut spent = Vec::new();
        for command in COMMANDS {
            eprintln!("{images} images: {}", command.join(" "));
            spent.push(run(command, &block, &folder.path().join("run"))?);
        }
        let [adjust, diagnose] = [spent[0], spent[1]];
        let figures = [adjust, diagnose].into_iter().flat_map(|of| [fixed(of.seconds, 1), fixed(of.bytes / 1e9, 2)]);
        table.row([images.to_string(), measurements.to_string()].into_iter().chain(figures));
        ends.push((images as f64, [adjust, diagnose]));
    }
    println!("\n{}", table.to_text());
    if let [(few, small), .., (many, large)] = ends.as_slice() {
        for (name, (small, large)) in TASKS.iter().zip(small.iter().zip(large)) {
            let exponent = |small: f64, large: f64| fixed((large / small).ln() / (many / few).ln(), 2);
            let (time, memory) = (exponent(small.seconds, large.seconds), exponent(small.bytes, large.bytes));
            println!("{name}: time grows with the images to the power of {time}, memory to that of {memory}");
        }
    }
    Ok(())
}

/// The area, enlarged; as many strips and points as keep overlap and density.
fn simulate(factor: f64, folder: &Path, block: &Path) -> Result<()> {
    let mut scenario: toml::Table = SCENARIO.parse()?;
    let plain = scenario["terrain"]["plain"].as_table_mut().context("a terrain")?;
    for side in ["length_m", "width_m"] {
        plain[side] = (plain[side].as_float().context("a length")? * factor).into();
    }
    for flight in scenario["flight"].as_array_mut().context("flights")? {
        let strips = flight["strips"].as_integer().context("strips")? as f64;
        flight["strips"] = ((strips * factor).round() as i64).into();
    }
    let file = folder.join("area.toml");
    std::fs::write(&file, toml::to_string(&scenario)?)?;
    let points = format!("points={}", (POINTS * factor * factor).round());
    let noise = ["--noise-px", "0.3", "--noise-survey", "--seed", SEED, "--set", &points];
    let mut program = Command::new(PROGRAM);
    program.args(["--quiet", "simulate"]).arg(&file).args(noise).arg("-o").arg(block).env("MISCLOSURE_CONFIG", "");
    let output = program.output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}

/// What a command took.
#[derive(Debug, Clone, Copy)]
struct Spent {
    seconds: f64,
    /// Largest resident memory.
    bytes: f64,
}

fn run(command: &[&str], block: &Path, run: &Path) -> Result<Spent> {
    let started = Instant::now();
    let mut child = Command::new(PROGRAM)
        .args(["--quiet", "--threads", "2"])
        .args(command)
        .arg(block)
        .arg("-o")
        .arg(run)
        .env("MISCLOSURE_CONFIG", "")
        .env("OPENBLAS_NUM_THREADS", "2")
        .stdout(Stdio::null())
        .spawn()?;
    let status = format!("/proc/{}/status", child.id());
    let mut bytes = 0.0;
    let ended = loop {
        if let Some(ended) = child.try_wait()? {
            break ended;
        }
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let peak = text.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix("kB"));
        bytes = peak.and_then(|peak| peak.trim().parse::<f64>().ok()).map_or(bytes, |peak| 1024.0 * peak);
        sleep(LOOK);
    };
    ensure!(ended.success(), "{}: {ended}", command.join(" "));
    Ok(Spent { seconds: started.elapsed().as_secs_f64(), bytes })
}
