//! In: the command line. Out: an exit code.
//! Frame and unit: none.

fn main() -> std::process::ExitCode {
    sheetlight::cli::main().into()
}
