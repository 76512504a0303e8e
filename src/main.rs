//! The `misclosure` program.

fn main() -> std::process::ExitCode {
    misclosure::program()
}
