//! Texts that have other programs start the workers of a campaign: one worker a shard.

/// Programs that start many processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Engine {
    /// An array of jobs of Slurm (`sbatch`).
    Slurm,
    /// A workflow of Snakemake.
    Snakemake,
    /// Tasks of HyperQueue.
    HyperQueue,
    /// GNU parallel.
    Parallel,
}

/// The script that works `folder` in so many shards, `jobs` cases at a time each.
pub fn script(engine: Engine, folder: &str, shards: usize, jobs: usize) -> String {
    let template = match engine {
        Engine::Slurm => include_str!("slurm.sh"),
        Engine::Snakemake => include_str!("snakemake.smk"),
        Engine::HyperQueue => include_str!("hyperqueue.sh"),
        Engine::Parallel => include_str!("parallel.sh"),
    };
    let numbers = template.replace("@SHARDS@", &shards.to_string()).replace("@JOBS@", &jobs.to_string());
    // Last: a folder may have any name.
    match engine {
        Engine::Snakemake => numbers.replace("@PYTHON_FOLDER@", &python(folder)),
        _ => numbers.replace("@FOLDER@", &quoted(folder)),
    }
}

/// As a word of a POSIX shell.
fn quoted(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text.to_owned(),
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

/// As a text of Python.
fn python(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_engine_starts_every_shard() {
        let of = |engine| script(engine, "/data/my campaign", 8, 2);
        let slurm = of(Engine::Slurm);
        assert!(slurm.contains("#SBATCH --array=1-8\n#SBATCH --cpus-per-task=2\n"), "{slurm}");
        let run = "misclosure campaign run '/data/my campaign' --shard";
        assert!(slurm.ends_with(&format!("{run} \"$SLURM_ARRAY_TASK_ID\"/8 --jobs 2\n")), "{slurm}");
        assert!(of(Engine::Parallel).contains(&format!("{run} {{}}/8 --jobs 2")), "{}", of(Engine::Parallel));
        let hyper = of(Engine::HyperQueue);
        assert!(hyper.contains("CAMPAIGN='/data/my campaign'\nhq submit --array 1-8 --cpus 2"), "{hyper}");
        let snake = of(Engine::Snakemake);
        assert!(snake.contains("FOLDER = \"/data/my campaign\""), "{snake}");
        assert!(snake.contains("--shard {wildcards.shard}/8"), "{snake}");
        for text in [slurm, hyper, snake, of(Engine::Parallel)] {
            assert!(!text.contains('@'), "{text}");
        }
    }

    #[test]
    fn words_of_a_shell_are_quoted() {
        assert_eq!([quoted("a/b-1.x"), quoted("a b"), quoted("it's")], ["a/b-1.x", "'a b'", "'it'\\''s'"]);
    }
}
