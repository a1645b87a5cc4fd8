//! In: the command line. Out: an exit code.
//! Frame and unit: none.

fn main() -> std::process::ExitCode {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Vulkan's loader complains on stderr when this is unset; any folder silences it.
        // SAFETY: the first statement of the program, no other thread exists that could read the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    sheetlight::cli::main().into()
}
