//! In: the command line. Out: one library call a subcommand, its result on stdout, talk on stderr.
//! Frame and unit: as the subcommands say; every number is printed with its unit.

mod bench;
mod board;
mod calibrate;
mod console;
mod demo;
mod doctor;
mod find;
mod guide;
mod insertion;
mod live;
mod model;
mod range;
mod scan;
mod shift_scan;
mod simulate;
mod station;
mod teach;
mod verify;

pub use console::Console;

use crate::fault::Result;
use clap::{Parser, Subcommand};

/// Sheet-of-light scanning with a robot: calibrate, scan, find, insert.
///
/// Data goes to stdout, talk to stderr. Exit code 0: done; 1: failed; 2: the command was misused.
#[derive(Parser)]
#[command(name = "sheetlight", version, max_term_width = 100)]
struct Cli {
    /// Print the result as JSON on stdout, for machines
    #[arg(long, global = true)]
    json: bool,
    /// No progress bars, no talk
    #[arg(long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bench(bench::Args),
    Board(board::Args),
    /// Calibrate a station's camera, laser plane, pointer or hand-eye from a recording
    #[command(subcommand)]
    Calibrate(calibrate::Command),
    Demo(demo::Args),
    Doctor(doctor::Args),
    Find(find::Args),
    Guide(guide::Args),
    Live(live::Args),
    Model(model::Args),
    Range(range::Args),
    Scan(scan::Args),
    ShiftScan(shift_scan::Args),
    /// Simulate a station with known truth: recordings, poses, true calibration
    Simulate(simulate::Args),
    Verify(verify::Args),
    /// Make, show, import into or export from a station folder
    #[command(subcommand)]
    Station(station::Command),
    Teach(teach::Args),
}

fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Bench(a) => bench::run(a, console),
        Command::Board(a) => board::run(a, console),
        Command::Calibrate(c) => calibrate::run(c, console),
        Command::Demo(a) => demo::run(a, console),
        Command::Doctor(a) => doctor::run(a, console),
        Command::Find(a) => find::run(a, console),
        Command::Guide(a) => guide::run(a, console),
        Command::Live(a) => live::run(a, console),
        Command::Model(a) => model::run(a, console),
        Command::Range(a) => range::run(a, console),
        Command::Scan(a) => scan::run(a, console),
        Command::ShiftScan(a) => shift_scan::run(a, console),
        Command::Simulate(a) => simulate::run(a, console),
        Command::Verify(a) => verify::run(a, console),
        Command::Station(c) => station::run(c, console),
        Command::Teach(a) => teach::run(a, console),
    }
}

/// Parses the command line, runs it, prints an error if there is one. Returns the exit code.
pub fn main() -> u8 {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            // Nothing is left to be said when even stderr is closed.
            let _ = e.print();
            return if e.use_stderr() { 2 } else { 0 };
        }
    };
    let console = Console::new(cli.json, cli.quiet);
    match run(&cli.command, &console) {
        Ok(()) => 0,
        Err(fault) => {
            console.fault(&fault);
            fault.exit_code()
        }
    }
}

/// Reads numbers parted by commas, for clap's `value_parser`.
pub(crate) fn numbers<const N: usize>(s: &str) -> std::result::Result<[f64; N], String> {
    let read: Option<Vec<f64>> = s.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    let read = read.and_then(|v| v.try_into().ok());
    read.ok_or_else(|| format!("wanted {N} numbers parted by commas, e.g. {}", vec!["0"; N].join(",")))
}

/// Reads an option's value with the type's own `FromStr`, for clap's `value_parser`.
pub(crate) fn parse<T: std::str::FromStr<Err = String>>(s: &str) -> std::result::Result<T, String> {
    s.parse()
}
