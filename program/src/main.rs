//! In: the command line. Out: an exit code.
//! Frame and unit: none.

/// A search allocates and frees layers of many megabytes. An allocator that keeps this memory, instead of returning it
/// to the system each time, searches in two thirds of the time (benches/runs/2026-11-27-2core-epyc, "Memory that comes
/// and goes").
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Vulkan's loader complains on stderr when this is unset; any folder silences it.
        // SAFETY: the first statement of the program, no other thread exists that could read the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    sheetlight_program::cli::main().into()
}
