//! The `misclosure` program.

#[global_allocator]
static ALLOCATOR: misclosure::Allocator = misclosure::Allocator;

fn main() -> std::process::ExitCode {
    misclosure::program()
}
