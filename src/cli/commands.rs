//! In: the words of the command line. Out: the subcommand that was meant, run; its exit code.
//! Frame and unit: none.

use super::capture::{camera, record};
use super::doctor::command as doctor;
use super::find::{batch, filter, ghost, import_map, locate as find, matching, model, program, second_look, teach};
use super::insert::{guide, job, robot, sweep};
use super::terminal::console::Console;
use super::terminal::threads;
use super::{bench, board, calibrate, cell, demo, live, range, scan, shift_scan, simulate, station, verify};
use crate::fault::Result;
use clap::{Parser, Subcommand};

/// Sheet-of-light scanning with a robot: calibrate, scan, find, insert.
///
/// Data goes to stdout, talk to stderr. Exit code 0: done; 1: failed; 2: the command was misused.
#[derive(Parser)]
#[command(name = "sheetlight", version, max_term_width = 100)]
#[command(after_help = "A first look, without camera, robot or GPU:
  sheetlight demo
A station, in this order:
  sheetlight station new --station cell3 --robot denso
  sheetlight calibrate camera recordings/intrinsics --station cell3
  sheetlight calibrate hand-eye recordings/handeye --station cell3
  sheetlight calibrate laser-plane recordings/laserplane --station cell3
  sheetlight scan recordings/board7 --station cell3 --out scans/board7
  sheetlight find scans/board7 --recipe data/recipes/led.toml --station cell3 --out pose.json")]
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
    Batch(batch::Args),
    Bench(bench::Args),
    Board(board::Args),
    /// Calibrate a station's camera, laser plane, pointer or hand-eye from a recording
    #[command(subcommand)]
    Calibrate(calibrate::Command),
    /// List, show and set cameras, take a picture, find the exposure
    #[command(subcommand)]
    Camera(camera::Command),
    /// A simulated robot cell
    #[command(subcommand)]
    Cell(cell::Command),
    Demo(demo::Args),
    Doctor(doctor::Args),
    Filter(filter::Args),
    Find(find::Args),
    Ghost(ghost::Args),
    Guide(guide::Args),
    ImportMap(import_map::Args),
    Job(job::Args),
    Live(live::Args),
    Match(matching::Args),
    Model(model::Args),
    Program(program::Args),
    Range(range::Args),
    Record(record::Args),
    /// Answer a robot that drives itself, try the outputs of one that is linked
    #[command(subcommand)]
    Robot(robot::Command),
    Scan(scan::Args),
    SecondLook(second_look::Args),
    ShiftScan(shift_scan::Args),
    /// Simulate a station with known truth: recordings, poses, true calibration
    Simulate(simulate::Args),
    /// Make, show, import into or export from a station folder
    #[command(subcommand)]
    Station(station::Command),
    Sweep(sweep::Args),
    Teach(teach::Args),
    Verify(verify::Args),
}

fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Batch(a) => batch::run(a, console),
        Command::Bench(a) => bench::run(a, console),
        Command::Board(a) => board::run(a, console),
        Command::Calibrate(c) => calibrate::run(c, console),
        Command::Camera(c) => camera::run(c, console),
        Command::Cell(c) => cell::run(c, console),
        Command::Demo(a) => demo::run(a, console),
        Command::Doctor(a) => doctor::run(a, console),
        Command::Filter(a) => filter::run(a, console),
        Command::Find(a) => find::run(a, console),
        Command::Ghost(a) => ghost::run(a, console),
        Command::Guide(a) => guide::run(a, console),
        Command::ImportMap(a) => import_map::run(a, console),
        Command::Job(a) => job::run(a, console),
        Command::Live(a) => live::run(a, console),
        Command::Match(a) => matching::run(a, console),
        Command::Model(a) => model::run(a, console),
        Command::Program(a) => program::run(a, console),
        Command::Range(a) => range::run(a, console),
        Command::Record(a) => record::run(a, console),
        Command::Robot(c) => robot::run(c, console),
        Command::Scan(a) => scan::run(a, console),
        Command::SecondLook(a) => second_look::run(a, console),
        Command::ShiftScan(a) => shift_scan::run(a, console),
        Command::Simulate(a) => simulate::run(a, console),
        Command::Verify(a) => verify::run(a, console),
        Command::Station(c) => station::run(c, console),
        Command::Sweep(a) => sweep::run(a, console),
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
    let done = threads::start().and_then(|()| run(&cli.command, &console));
    match done.and_then(|()| console.finish()) {
        Ok(()) => 0,
        Err(fault) => {
            console.fault(&fault);
            fault.exit_code()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// What a text shows to be typed: its lines, joined where a backslash ends them, from each `sheetlight` on.
    fn shown(text: &str) -> Vec<String> {
        let joined = text.replace("\\\n", " ");
        let calls =
            joined.lines().filter(|l| l.starts_with("  ")).filter_map(|l| l.split_once("sheetlight ")).map(|(_, c)| c);
        calls.map(|c| c.split(['>', '#']).next().unwrap_or_default().trim().to_owned()).collect()
    }

    /// As a shell parts them, where no word has a blank in it.
    fn words(call: &str) -> impl Iterator<Item = &str> {
        call.split_whitespace().map(|w| w.trim_matches('\''))
    }

    fn parses(call: &str) {
        let parsed = Cli::try_parse_from(std::iter::once("sheetlight").chain(words(call)));
        assert!(parsed.is_ok(), "sheetlight {call}\n{}", parsed.err().map(|e| e.to_string()).unwrap_or_default());
    }

    fn check(command: &clap::Command) -> usize {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let wide = help.lines().find(|l| l.len() > 98);
        assert!(wide.is_none(), "{}: wraps in the help: {wide:?}", command.get_name());
        let calls = shown(&help);
        calls.iter().for_each(|c| parses(c));
        calls.len() + command.get_subcommands().map(check).sum::<usize>()
    }

    #[test]
    fn every_command_that_help_and_readme_show_can_be_typed() {
        let command = Cli::command();
        assert!(check(&command) > 20);
        let readme = shown(include_str!("../../README.md"));
        assert!(readme.len() > 8, "{readme:?}");
        readme.iter().for_each(|c| parses(c));
        // Every option and argument says what it is.
        fn told(command: &clap::Command) {
            for a in command.get_arguments() {
                assert!(a.get_help().is_some(), "{} {} has no help", command.get_name(), a.get_id());
            }
            command.get_subcommands().for_each(told);
        }
        told(&command);
    }

    #[test]
    fn a_station_is_named_by_its_option_everywhere() {
        for verb in ["new", "show", "export --out x.json"] {
            let call = format!("sheetlight station {verb} cell3");
            let said = Cli::try_parse_from(call.split_whitespace()).err().expect("no place for it").to_string();
            assert!(said.contains("'cell3'") && said.contains("--station <STATION>"), "{said}");
        }
    }
}
